# The study beside what its source says: the points of the plan `paper`.


rule write_validation:
    input:
        measures=lambda wildcards: WORK.every_point(POINTS, "tables/quantities.json", VALIDATION),
        templates=WORK.page_templates("validation/validation.html.j2", package="evidence"),
    output:
        page=shown(WORK.of_study("validation", "report.html"), "validation", "Validation"),
        numbers=WORK.of_study("validation", "validation.json"),
        tables=multiext(
            WORK.of_study("validation", ""),
            "packings.parquet",
            "effects.parquet",
        ),
    params:
        command=f"./run validate --config study={STUDY} plan={VALIDATION}",
        runs=lambda wildcards, input: [str(Path(file).parent.parent) for file in input.measures],
        source=source_hash("evidence.validation.report"),
    shell:
        "python -m evidence validate --out $(dirname {output.page}) --command {params.command:q}"
        " {params.runs} > {log} 2>&1"
