# The mean drag over one field of the study's sweep, and the power law in it.


def scaling_options(wildcards):
    """What the study's block scaling asks for, as options of the command line."""
    scaling = CASES[0].study.scaling
    if scaling is None:
        raise WorkflowError(
            f"{relative(CASES[0].file)}: scaling: a required key is missing\n"
            "  remedy: name the field to fit a power law over, see docs/scaling.md"
        )
    options = ["--field", scaling.field]
    if scaling.expected_exponent is not None:
        options += ["--expected", scaling.expected_exponent]
    if scaling.source is not None:
        options += ["--source", scaling.source]
    if scaling.fit_range is not None:
        options += ["--fit-range", *scaling.fit_range]
    return " ".join(quote(str(option)) for option in options)


rule write_scaling:
    input:
        every("process", "tables/workpiece_force.parquet"),
    output:
        multiext(of_study("scaling", "scaling."), "csv", "json"),
        figure=report(
            of_study("scaling", "scaling.png"),
            caption="../report/scaling.rst",
            category="Scaling",
            labels={"run": "all", "figure": "scaling"},
        ),
    log:
        of_study("scaling", "logs/scaling.log"),
    benchmark:
        of_study("scaling", "benchmarks/scaling.tsv")
    conda:
        "../envs/python.yaml"
    params:
        runs=every_folder("process"),
        options=scaling_options,
        command=f"snakemake scaling --config study={STUDY}",
        source=source_hash("dragchain.scaling.fit"),
    shell:
        "dragchain step scaling --out $(dirname {output.figure}) {params.options}"
        " --command '{params.command}' -- {params.runs} 2>&1 | tee -i {log}"
