# The stability map: four regimes of small runs.


# Many runs of seconds in one job; a job that is interrupted goes on where it was, and a run that
# fails is a finding.
rule map_stability:
    input:
        points=config["stability_map"],
        study="studies/stability/study.yaml",
        scenes=WORK.files("templates/*.j2"),
        templates=WORK.page_templates("stability/stability.html.j2", package="evidence"),
    output:
        page=shown("results/stability/report.html", "stability", "Stability", "stability"),
        tables=multiext("results/stability/", "points.csv", "points.parquet"),
        conditions=multiext("results/stability/", "conditions.csv", "conditions.parquet"),
        measured="results/stability/stability.json",
    threads: min(workflow.cores, or_stop(cores_here))
    resources:
        prints=1,
    params:
        source=source_hash("evidence.stability.report"),
    shell:
        "python -m evidence stability --map {input.points:q} --cores {threads}"
        " --out $(dirname {output.page}) 2>&1 | tee -i {log}"
