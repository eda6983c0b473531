# What the runs of a study that asks for a tolerance will take, before they begin.


# No run waits for it, so that a new forecast makes no run anew: it goes before all others.
rule advise:
    input:
        home,
    output:
        "results/{study}/advice.json",
    priority: 2
    localrule: True
    params:
        cases=lambda wildcards: [
            SCENES["process"].digest(case)
            for case in by_run(WORK.of(wildcards.study).cases, SCENES["process"]).values()
        ],
        fidelity=WORK.fidelity_option,
        source=source_hash("dragdeck.advice.forecast"),
    shell:
        "dragdeck advise {wildcards.study} {params.fidelity} > {log} 2>&1"
