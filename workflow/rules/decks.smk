# Decks: everything a run starts from.


rule render_drop:
    input:
        deck_inputs,
    output:
        deck=DROP + "in.liggghts",
        case=DROP + "case.json",
        columns=DROP + "columns.json",
        balls=DROP + "ball.data",
    params:
        fidelity=fidelity_option,
        source=source_hash("dragdeck.render"),
    log:
        DROP + "logs/render.log",
    benchmark:
        DROP + "benchmarks/render.tsv"
    shell:
        "dragdeck render {wildcards.study} drop {wildcards.run} {params.fidelity} > {log} 2>&1"


rule render_fill:
    input:
        deck_inputs,
    output:
        deck=FILL + "in.liggghts",
        case=FILL + "case.json",
        columns=FILL + "columns.json",
        balls=FILL + "balls.data",
    params:
        fidelity=fidelity_option,
        source=source_hash("dragdeck.render"),
    log:
        FILL + "logs/render.log",
    benchmark:
        FILL + "benchmarks/render.tsv"
    shell:
        "dragdeck render {wildcards.study} fill {wildcards.run} {params.fidelity} > {log} 2>&1"


def fill_table(wildcards):
    """The settled bed that a process run starts from."""
    fill = case_of("process", wildcards.run).run_ids["fill"]
    return (FILL + "tables/fill.json").format(study=wildcards.study, run=fill)


rule render_process:
    input:
        deck_inputs,
        bed=fill_table,
    output:
        deck=PROCESS + "in.liggghts",
        case=PROCESS + "case.json",
        columns=PROCESS + "columns.json",
        tool=PROCESS + "tool.stl",
    params:
        fidelity=fidelity_option,
        source=source_hash("dragdeck.render"),
    log:
        PROCESS + "logs/render.log",
    benchmark:
        PROCESS + "benchmarks/render.tsv"
    shell:
        "dragdeck render {wildcards.study} process {wildcards.run} {params.fidelity}"
        " --fill-table {input.bed} > {log} 2>&1"
