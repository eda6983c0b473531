# Engine runs. run.json exists only for a run that is complete and passed its
# gates; whatever an interrupted run left stays beside it and is gone on with.


rule run_drop:
    input:
        DROP + "in.liggghts",
        DROP + "case.json",
        DROP + "columns.json",
        DROP + "ball.data",
    output:
        DROP + "run.json",
    params:
        source=source_hash("dragdeck.runner"),
    log:
        DROP + "logs/run.log",
    benchmark:
        DROP + "benchmarks/run.tsv"
    shell:
        "dragdeck run $(dirname {output}) 2>&1 | tee -i {log}"


rule run_fill:
    input:
        FILL + "in.liggghts",
        FILL + "case.json",
        FILL + "columns.json",
        FILL + "balls.data",
    output:
        FILL + "run.json",
    params:
        source=source_hash("dragdeck.runner"),
    log:
        FILL + "logs/run.log",
    benchmark:
        FILL + "benchmarks/run.tsv"
    threads: ranks("fill")
    shell:
        "dragdeck run $(dirname {output}) 2>&1 | tee -i {log}"


def fill_run(wildcards):
    """The fill that a process run starts from."""
    fill = case_of("process", wildcards.run).run_ids["fill"]
    return (FILL + "run.json").format(study=wildcards.study, run=fill)


rule run_process:
    input:
        PROCESS + "in.liggghts",
        PROCESS + "case.json",
        PROCESS + "columns.json",
        PROCESS + "tool.stl",
        fill=fill_run,
    output:
        PROCESS + "run.json",
    params:
        source=source_hash("dragdeck.runner"),
    log:
        PROCESS + "logs/run.log",
    benchmark:
        PROCESS + "benchmarks/run.tsv"
    threads: ranks("process")
    shell:
        "dragdeck run $(dirname {output}) 2>&1 | tee -i {log}"
