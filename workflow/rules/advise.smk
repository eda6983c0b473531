# What the runs of a study that asks for a tolerance will take, measured before
# they begin on a machine that does nothing else.


rule advise:
    output:
        ADVICE,
    log:
        f"results/{STUDY}/logs/advise.log",
    benchmark:
        f"results/{STUDY}/benchmarks/advise.tsv"
    conda:
        "../envs/python.yaml"
    threads: workflow.cores
    params:
        cases=[SCENES["process"].digest(case) for case in by_run(CASES, SCENES["process"]).values()],
        fidelity=fidelity_option,
        study=STUDY,
        source=source_hash("dragdeck.advice.forecast"),
    shell:
        "dragdeck advise {params.study} {params.fidelity} > {log} 2>&1"
