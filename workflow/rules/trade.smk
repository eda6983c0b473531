# The trade of speed against accuracy: the process at the points of a plan. A
# point that fails is a finding; its outcome says how.


rule render_point:
    input:
        templates_of("process"),
        bed=lambda wildcards: bed_of_point(wildcards, "tables/fill.json"),
    output:
        deck=of_point("in.liggghts"),
        case=of_point("case.json"),
        columns=of_point("columns.json"),
        tool=of_point("tool.stl"),
    log:
        of_point("logs/render.log"),
    benchmark:
        of_point("benchmarks/render.tsv")
    conda:
        "../envs/python.yaml"
    params:
        case=lambda wildcards: points_by_run("process")[wildcards.run].digest("process"),
        plan=PLAN,
        source=source_hash("dragdeck.render"),
    shell:
        "dragdeck render {wildcards.study} process {wildcards.run} --plan {params.plan}"
        " --fill-table {input.bed} > {log} 2>&1"


rule run_point:
    input:
        of_point("in.liggghts"),
        of_point("case.json"),
        of_point("columns.json"),
        of_point("tool.stl"),
        fill=lambda wildcards: bed_of_point(wildcards, "run.json"),
    output:
        of_point("outcome.json"),
    log:
        of_point("logs/run.log"),
    benchmark:
        of_point("benchmarks/run.tsv")
    conda:
        "../envs/python.yaml"
    threads: lambda wildcards: points_by_run("process")[wildcards.run].study.chosen_fidelity().ranks
    params:
        source=source_hash("dragdeck.runner"),
    shell:
        "dragdeck run $(dirname {output}) --outcome {output} --every 60 2>&1 | tee -i {log}"


rule measure_point:
    input:
        of_point("outcome.json"),
        bed=lambda wildcards: bed_of_point(wildcards, "tables/fill.json"),
    output:
        of_point("measures.json"),
    log:
        of_point("logs/measures.log"),
    benchmark:
        of_point("benchmarks/measures.tsv")
    conda:
        "../envs/python.yaml"
    params:
        source=source_hash("dragchain.measures"),
    shell:
        "dragchain measure $(dirname {output}) --fill-table {input.bed} > {log} 2>&1"


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
        template=str(PROJECT.root / "analysis/dragchain/trade.html.j2"),
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
        reference=lambda wildcards: f"results/{STUDY}/trade/{next(iter(points_by_run('process')))}",
        drops=lambda wildcards: [f"results/{STUDY}/drop/{run}" for run in points_by_run("drop")],
        costs=lambda wildcards, input: f"--costs {input.costs}" if input.costs else "",
        plan=Path(PLAN).stem,
        command=f"snakemake trade --config study={STUDY} plan={PLAN}",
        largest_step=lambda wildcards: safe_step(CASES[0]),
        source=source_hash("dragchain.trade_report"),
    shell:
        "dragchain trade --out $(dirname {output.page}) --plan {params.plan}"
        " --command '{params.command}' --largest-step {params.largest_step}"
        " --reference {params.reference} {params.costs} --drops {params.drops}"
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
