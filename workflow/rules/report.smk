# Figures of each run, and the report on the study.


rule draw_drop:
    input:
        of_drop("tables/impacts.parquet"),
        run=of_drop("run.json"),
    output:
        report(
            of_drop("figures/drop.png"),
            caption="../report/drop.rst",
            category="Drop test",
            labels={"run": "{run}", "figure": "impacts"},
        ),
        of_drop("tables/figures.json"),
    log:
        of_drop("logs/figures.log"),
    benchmark:
        of_drop("benchmarks/figures.tsv")
    conda:
        "../envs/python.yaml"
    params:
        source=source_hash("dragchain.figures"),
    shell:
        "dragchain figures $(dirname {input.run}) > {log} 2>&1"


rule draw_fill:
    input:
        of_fill("tables/fill.json"),
        of_fill("tables/thermo.parquet"),
        run=of_fill("run.json"),
    output:
        report(
            of_fill("figures/fill.png"),
            caption="../report/fill.rst",
            category="Fill",
            labels={"run": "{run}", "figure": "settling"},
        ),
        of_fill("tables/figures.json"),
    log:
        of_fill("logs/figures.log"),
    benchmark:
        of_fill("benchmarks/figures.tsv")
    conda:
        "../envs/python.yaml"
    params:
        source=source_hash("dragchain.figures"),
    shell:
        "dragchain figures $(dirname {input.run}) > {log} 2>&1"


FIGURES = [
    "forces",
    "network_xy",
    "network_xz",
    "force_around_rod",
    "force_depth",
    "chains_peaks",
]


rule draw_process:
    input:
        multiext(
            of_process("tables/"),
            "rod_force.parquet",
            "rod_contacts.parquet",
            "balls.parquet",
            "contacts.parquet",
            "network.parquet",
            "chains.parquet",
        ),
        run=of_process("run.json"),
    output:
        [
            report(
                of_process(f"figures/{name}.png"),
                caption=f"../report/{name}.rst",
                category="Process",
                labels={"run": "{run}", "figure": name},
            )
            for name in FIGURES
        ],
        of_process("tables/figures.json"),
    log:
        of_process("logs/figures.log"),
    benchmark:
        of_process("benchmarks/figures.tsv")
    conda:
        "../envs/python.yaml"
    params:
        source=source_hash("dragchain.figures"),
    shell:
        "dragchain figures $(dirname {input.run}) > {log} 2>&1"


rule write_report:
    input:
        of_every_run,
        advice=asked_advice,
        templates=page_templates("report.html.j2"),
    output:
        csv=of_report("summary.csv"),
        parquet=of_report("summary.parquet"),
        page=report(
            of_report("report.html"),
            caption="../report/report.rst",
            category="Report",
            labels={"run": "all", "figure": "report"},
        ),
    log:
        of_report("logs/report.log"),
    benchmark:
        of_report("benchmarks/report.tsv")
    conda:
        "../envs/python.yaml"
    params:
        runs=lambda wildcards: every_folder("process"),
        advice=advice_option,
        source=source_hash("dragchain.report"),
    shell:
        "dragchain report --out $(dirname {output.csv}) {params.runs} {params.advice} > {log} 2>&1"
