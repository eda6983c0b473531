# The report on the study.


rule write_report:
    input:
        [
            every(name, "run.json", *(f"tables/{table}" for table in scene.tables))
            for name, scene in SCENES.items()
        ],
        [every(name, "tables/figures.json") for name in SCENES],
        every("process", "tables/loading.json"),
        advice=asked_advice("process"),
        templates=page_templates("report/report.html.j2"),
    output:
        csv=of_study("report", "summary.csv"),
        parquet=of_study("report", "summary.parquet"),
        page=report(
            of_study("report", "report.html"),
            caption="../report/report.rst",
            category="Report",
            labels={"run": "all", "figure": "report"},
        ),
    log:
        of_study("report", "logs/report.log"),
    benchmark:
        of_study("report", "benchmarks/report.tsv")
    conda:
        "../envs/python.yaml"
    params:
        runs=lambda wildcards: every_folder("process"),
        advice=advice_option,
        source=source_hash("dragchain.report.study_report"),
    shell:
        "dragchain report --out $(dirname {output.csv}) {params.runs} {params.advice} > {log} 2>&1"
