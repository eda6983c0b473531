# Engine runs. run.json exists only for a run that is complete and passed its
# gates; whatever an interrupted run left stays beside it and is gone on with.


rule run_drop:
    input:
        of_drop("in.liggghts"),
        of_drop("case.json"),
        of_drop("columns.json"),
        of_drop("ball.data"),
    output:
        of_drop("run.json"),
    log:
        of_drop("logs/run.log"),
    benchmark:
        of_drop("benchmarks/run.tsv")
    conda:
        "../envs/python.yaml"
    params:
        source=source_hash("dragdeck.runner"),
    shell:
        "dragdeck run $(dirname {output}) 2>&1 | tee -i {log}"


rule run_fill:
    input:
        of_fill("in.liggghts"),
        of_fill("case.json"),
        of_fill("columns.json"),
        of_fill("balls.data"),
        advice=asked_advice,
    output:
        of_fill("run.json"),
    log:
        of_fill("logs/run.log"),
    benchmark:
        of_fill("benchmarks/run.tsv")
    conda:
        "../envs/python.yaml"
    threads: ranks("fill")
    params:
        source=source_hash("dragdeck.runner"),
    shell:
        "dragdeck run $(dirname {output}) 2>&1 | tee -i {log}"


rule run_process:
    input:
        of_process("in.liggghts"),
        of_process("case.json"),
        of_process("columns.json"),
        of_process("tool.stl"),
        advice=asked_advice,
        fill=lambda wildcards: fill_of(wildcards, "run.json"),
    output:
        of_process("run.json"),
    log:
        of_process("logs/run.log"),
    benchmark:
        of_process("benchmarks/run.tsv")
    conda:
        "../envs/python.yaml"
    threads: ranks("process")
    params:
        source=source_hash("dragdeck.runner"),
    shell:
        "dragdeck run $(dirname {output}) 2>&1 | tee -i {log}"
