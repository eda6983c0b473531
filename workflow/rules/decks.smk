# Decks: everything a run starts from.


rule render_drop:
    input:
        templates_of("drop"),
    output:
        deck=of_drop("in.liggghts"),
        case=of_drop("case.json"),
        columns=of_drop("columns.json"),
        balls=of_drop("ball.data"),
    log:
        of_drop("logs/render.log"),
    benchmark:
        of_drop("benchmarks/render.tsv")
    conda:
        "../envs/python.yaml"
    params:
        case=digest_of("drop"),
        cases=case_option("drop"),
        source=source_hash("dragdeck.render"),
    shell:
        "dragdeck render {wildcards.study} drop {wildcards.run} {params.cases} > {log} 2>&1"


rule render_fill:
    input:
        templates_of("fill"),
    output:
        deck=of_fill("in.liggghts"),
        case=of_fill("case.json"),
        columns=of_fill("columns.json"),
        balls=of_fill("balls.data"),
    log:
        of_fill("logs/render.log"),
    benchmark:
        of_fill("benchmarks/render.tsv")
    conda:
        "../envs/python.yaml"
    params:
        case=digest_of("fill"),
        cases=case_option("fill"),
        source=source_hash("dragdeck.render"),
    shell:
        "dragdeck render {wildcards.study} fill {wildcards.run} {params.cases} > {log} 2>&1"


rule render_process:
    input:
        templates_of("process"),
        bed=lambda wildcards: fill_of(wildcards, "tables/fill.json"),
    output:
        deck=of_process("in.liggghts"),
        case=of_process("case.json"),
        columns=of_process("columns.json"),
        tool=of_process("tool.stl"),
    log:
        of_process("logs/render.log"),
    benchmark:
        of_process("benchmarks/render.tsv")
    conda:
        "../envs/python.yaml"
    params:
        case=digest_of("process"),
        fidelity=fidelity_option,
        source=source_hash("dragdeck.render"),
    shell:
        "dragdeck render {wildcards.study} process {wildcards.run} {params.fidelity}"
        " --fill-table {input.bed} > {log} 2>&1"
