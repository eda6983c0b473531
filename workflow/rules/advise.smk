# What the runs of a study that asks for a tolerance will take, before they begin.


rule advise:
    output:
        WORK.advice,
    priority: 1
    localrule: True
    params:
        study=STUDY,
        cases=[SCENES["process"].digest(case) for case in by_run(CASES, SCENES["process"]).values()],
        fidelity=WORK.fidelity_option,
        source=source_hash("dragdeck.advice.forecast"),
    shell:
        "dragdeck advise {params.study} {params.fidelity} > {log} 2>&1"
