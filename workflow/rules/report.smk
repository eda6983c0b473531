# Figures of each run, and the report on the study.


rule draw_drop:
    input:
        DROP + "tables/impacts.parquet",
        run=DROP + "run.json",
    output:
        report(
            DROP + "figures/drop.png",
            caption="../report/drop.rst",
            category="Drop test",
            labels={"run": "{run}", "figure": "impacts"},
        ),
        DROP + "tables/figures.json",
    params:
        source=source_hash("dragchain.figures"),
    log:
        DROP + "logs/figures.log",
    benchmark:
        DROP + "benchmarks/figures.tsv"
    shell:
        "dragchain figures $(dirname {input.run}) > {log} 2>&1"


rule draw_fill:
    input:
        FILL + "tables/fill.json",
        FILL + "tables/thermo.parquet",
        run=FILL + "run.json",
    output:
        report(
            FILL + "figures/fill.png",
            caption="../report/fill.rst",
            category="Fill",
            labels={"run": "{run}", "figure": "settling"},
        ),
        FILL + "tables/figures.json",
    params:
        source=source_hash("dragchain.figures"),
    log:
        FILL + "logs/figures.log",
    benchmark:
        FILL + "benchmarks/figures.tsv"
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
            PROCESS + "tables/",
            "rod_force.parquet",
            "rod_contacts.parquet",
            "balls.parquet",
            "contacts.parquet",
            "network.parquet",
            "chains.parquet",
        ),
        run=PROCESS + "run.json",
    output:
        [
            report(
                PROCESS + f"figures/{name}.png",
                caption=f"../report/{name}.rst",
                category="Process",
                labels={"run": "{run}", "figure": name},
            )
            for name in FIGURES
        ],
        PROCESS + "tables/figures.json",
    params:
        source=source_hash("dragchain.figures"),
    log:
        PROCESS + "logs/figures.log",
    benchmark:
        PROCESS + "benchmarks/figures.tsv"
    shell:
        "dragchain figures $(dirname {input.run}) > {log} 2>&1"


def of_every_run(wildcards):
    """All that the report reads."""
    return [
        *every("process", "run.json"),
        *every("process", "tables/figures.json"),
        *every("process", "tables/closure.json"),
        *every("fill", "run.json"),
        *every("fill", "tables/fill.json"),
        *every("fill", "tables/figures.json"),
        *every("drop", "run.json"),
        *every("drop", "tables/impacts.parquet"),
        *every("drop", "tables/figures.json"),
    ]


rule write_report:
    input:
        of_every_run,
        template=str(PROJECT.root / "analysis/dragchain/report.html.j2"),
    output:
        multiext(f"results/{STUDY}/report/", "summary.csv", "summary.parquet"),
        report(
            f"results/{STUDY}/report/report.html",
            caption="../report/report.rst",
            category="Report",
            labels={"run": "all", "figure": "report"},
        ),
    params:
        folder=f"results/{STUDY}/report",
        runs=lambda wildcards: [folder.rstrip("/") for folder in every("process", "")],
        source=source_hash("dragchain.report"),
    log:
        f"results/{STUDY}/report/logs/report.log",
    benchmark:
        f"results/{STUDY}/report/benchmarks/report.tsv"
    shell:
        "dragchain report --out {params.folder} {params.runs} > {log} 2>&1"
