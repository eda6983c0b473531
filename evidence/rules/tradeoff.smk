# The trade-off of speed against accuracy: costs, report and checks.


# Processor times side by side: no other job may run meanwhile.
rule measure_costs:
    input:
        WORK.templates_of("filling"),
        WORK.templates_of("process"),
        design="evidence/costs.yaml",
    output:
        WORK.of_tradeoff("costs.json"),
    threads: min(workflow.cores, or_stop(cores_here))
    resources:
        prints=1,
    params:
        study=STUDY,
        fidelity=WORK.fidelity_option,
        rounds=lambda wildcards: WORK.points_of(PLAN).cost_rounds,
        cases=[scene.digest(CASES[0]) for scene in SCENES.values()],
        source=source_hash("evidence.costs"),
    shell:
        "python -m evidence costs {params.study} {params.fidelity} --rounds {params.rounds}"
        " --out {output} 2>&1 | tee -i {log}"


rule write_tradeoff:
    input:
        measures=lambda wildcards: WORK.every_point(POINTS, "tables/quantities.json"),
        drops=lambda wildcards: WORK.every_point("drop_test", "tables/impacts.parquet"),
        costs=lambda wildcards: (
            [WORK.of_tradeoff("costs.json")] if WORK.points_of(PLAN).cost_rounds else []
        ),
        templates=WORK.page_templates("tradeoff/tradeoff.html.j2"),
    output:
        page=shown(WORK.of_tradeoff("report.html"), "tradeoff", "Tradeoff"),
        measured=WORK.of_tradeoff("tradeoff.json"),
        runs=multiext(WORK.of_tradeoff(""), "runs.csv", "runs.parquet"),
        errors=multiext(WORK.of_tradeoff(""), "errors.csv", "errors.parquet"),
    params:
        reference=lambda wildcards: WORK.every_point(POINTS, "")[0],
        drops=lambda wildcards: WORK.every_point("drop_test", ""),
        costs=lambda wildcards, input: f"--costs {input.costs}" if input.costs else "",
        plan=Path(PLAN).stem,
        command=f"./run tradeoff --config study={STUDY} plan={PLAN}",
        largest_step=lambda wildcards: largest_of_case(CASES[0], SCENES["process"]),
        source=source_hash("dragchain.tradeoff.report"),
    shell:
        "dragchain step tradeoff --out $(dirname {output.page}) --plan {params.plan}"
        " --command {params.command:q} --largest-step {params.largest_step}"
        " --reference {params.reference} {params.costs} --drops {params.drops}"
        " -- {input.measures} > {log} 2>&1"
