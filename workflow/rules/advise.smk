# What the runs of a study that asks for a tolerance will take, before they begin.


# No run waits for it, so that a new forecast makes no run anew: it goes before all others.
rule advise:
    input:
        HOME,
    output:
        WORK.advice,
    priority: 2
    localrule: True
    params:
        study=STUDY,
        cases=[SCENES["process"].digest(case) for case in by_run(CASES, SCENES["process"]).values()],
        fidelity=WORK.fidelity_option,
        source=source_hash("dragdeck.advice.forecast"),
    shell:
        "dragdeck advise {params.study} {params.fidelity} > {log} 2>&1"
