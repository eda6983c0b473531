# What the runs of a study that asks for a tolerance will take, before they begin: by the speed of
# earlier runs, or as assumed. `dragdeck advise` measures the speed; its advice.json stays.


rule advise:
    output:
        WORK.advice,
    log:
        f"results/{STUDY}/logs/advise.log",
    benchmark:
        f"results/{STUDY}/benchmarks/advise.tsv"
    priority: 1
    conda:
        "../envs/python.yaml"
    params:
        cases=[SCENES["process"].digest(case) for case in by_run(CASES, SCENES["process"]).values()],
        fidelity=WORK.fidelity_option,
        study=STUDY,
        source=source_hash("dragdeck.advice.forecast"),
    shell:
        "dragdeck advise {params.study} {params.fidelity} --quick > {log} 2>&1"
