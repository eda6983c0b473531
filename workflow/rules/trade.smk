# The trade of speed against accuracy: costs, report and checks.


# Processor times side by side: no other job may run meanwhile.
rule measure_costs:
    input:
        templates_of("drop"),
        templates_of("fill"),
        templates_of("process"),
    output:
        of_trade("costs.json"),
    log:
        of_trade("logs/costs.log"),
    benchmark:
        of_trade("benchmarks/costs.tsv")
    conda:
        "../envs/python.yaml"
    threads: workflow.cores
    params:
        study=STUDY,
        fidelity=fidelity_option,
        rounds=lambda wildcards: points().cost_rounds,
        case=CASES[0].digest("process"),
        source=source_hash("dragdeck.costs_run"),
    shell:
        "dragdeck costs {params.study} {params.fidelity} --rounds {params.rounds}"
        " --out {output} 2>&1 | tee -i {log}"


rule write_trade:
    input:
        measures=lambda wildcards: every_point("measures.json"),
        drops=lambda wildcards: every_drop_point("tables/impacts.parquet"),
        costs=lambda wildcards: [of_trade("costs.json")] if points().cost_rounds else [],
        templates=page_templates("trade.html.j2"),
    output:
        page=report(
            of_trade("report.html"),
            caption="../report/trade.rst",
            category="Trade",
            labels={"run": "all", "figure": "report"},
        ),
        measured=of_trade("trade.json"),
        runs=multiext(of_trade(""), "runs.csv", "runs.parquet"),
        errors=multiext(of_trade(""), "errors.csv", "errors.parquet"),
    log:
        of_trade("logs/report.log"),
    benchmark:
        of_trade("benchmarks/report.tsv")
    conda:
        "../envs/python.yaml"
    params:
        reference=lambda wildcards: f"results/{STUDY}/points/{next(iter(points_by_run('process')))}",
        drops=lambda wildcards: [f"results/{STUDY}/drop/{run}" for run in points_by_run("drop")],
        costs=lambda wildcards, input: f"--costs {input.costs}" if input.costs else "",
        checks=checks_option,
        plan=Path(PLAN).stem,
        command=f"snakemake trade --config study={STUDY} plan={PLAN}",
        largest_step=lambda wildcards: safe_step(CASES[0]),
        source=source_hash("dragchain.trade_report"),
    shell:
        "dragchain trade --out $(dirname {output.page}) --plan {params.plan}"
        " --command '{params.command}' --largest-step {params.largest_step}"
        " --reference {params.reference} {params.costs} {params.checks} --drops {params.drops}"
        " -- {input.measures} > {log} 2>&1"


# What the advisor promised, in scenes that it was not measured on: plan=checks.
rule write_checks:
    input:
        lambda wildcards: every_point("measures.json"),
    output:
        checks=of_trade("checks.json"),
        table=of_trade("checks.csv"),
    log:
        of_trade("logs/checks.log"),
    benchmark:
        of_trade("benchmarks/checks.tsv")
    conda:
        "../envs/python.yaml"
    params:
        source=source_hash("dragchain.checks"),
    shell:
        "dragchain checks --out $(dirname {output.checks}) {input} 2>&1 | tee -i {log}"
