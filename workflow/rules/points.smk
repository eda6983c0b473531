# The process at the points of a plan. A point that fails is a finding; its
# outcome says how.


rule render_point:
    input:
        templates_of("process"),
        bed=lambda wildcards: bed_of_point(wildcards, "tables/fill.json"),
    output:
        deck=of_point("in.liggghts"),
        case=of_point("case.json"),
        columns=of_point("columns.json"),
        tool=of_point("tool.stl"),
    log:
        of_point("logs/render.log"),
    benchmark:
        of_point("benchmarks/render.tsv")
    conda:
        "../envs/python.yaml"
    params:
        case=lambda wildcards: point(wildcards.run).digest("process"),
        plan=lambda wildcards: plan_of("process", wildcards.run),
        source=source_hash("dragdeck.render"),
    shell:
        "dragdeck render {wildcards.study} process {wildcards.run} --plan {params.plan}"
        " --fill-table {input.bed} > {log} 2>&1"


rule run_point:
    input:
        of_point("in.liggghts"),
        of_point("case.json"),
        of_point("columns.json"),
        of_point("tool.stl"),
        fill=lambda wildcards: bed_of_point(wildcards, "run.json"),
    output:
        of_point("outcome.json"),
    log:
        of_point("logs/run.log"),
    benchmark:
        of_point("benchmarks/run.tsv")
    conda:
        "../envs/python.yaml"
    threads: lambda wildcards: point(wildcards.run).ranks
    params:
        source=source_hash("dragdeck.runner"),
    shell:
        "dragdeck run $(dirname {output}) --outcome {output} --every 60 2>&1 | tee -i {log}"


rule measure_point:
    input:
        of_point("outcome.json"),
        bed=lambda wildcards: bed_of_point(wildcards, "tables/fill.json"),
    output:
        of_point("measures.json"),
    log:
        of_point("logs/measures.log"),
    benchmark:
        of_point("benchmarks/measures.tsv")
    conda:
        "../envs/python.yaml"
    params:
        source=source_hash("dragchain.measures"),
    shell:
        "dragchain measure $(dirname {output}) --fill-table {input.bed} > {log} 2>&1"
