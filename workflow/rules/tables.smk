# Tables: raw engine output to Parquet.


rule tabulate_drop:
    input:
        of_drop("run.json"),
    output:
        of_drop("tables/impacts.parquet"),
    log:
        of_drop("logs/tables.log"),
    benchmark:
        of_drop("benchmarks/tables.tsv")
    conda:
        "../envs/python.yaml"
    params:
        source=source_hash("dragchain.tables"),
    shell:
        "dragchain tables $(dirname {input}) > {log} 2>&1"


rule tabulate_fill:
    input:
        of_fill("run.json"),
    output:
        of_fill("tables/fill.json"),
        of_fill("tables/thermo.parquet"),
    log:
        of_fill("logs/tables.log"),
    benchmark:
        of_fill("benchmarks/tables.tsv")
    conda:
        "../envs/python.yaml"
    params:
        source=source_hash("dragchain.tables"),
    shell:
        "dragchain tables $(dirname {input}) > {log} 2>&1"


rule tabulate_process:
    input:
        of_process("run.json"),
    output:
        multiext(
            of_process("tables/"),
            "thermo.parquet",
            "rod_force.parquet",
            "rod_contacts.parquet",
            "balls.parquet",
            "contacts.parquet",
            "closure.json",
        ),
    log:
        of_process("logs/tables.log"),
    benchmark:
        of_process("benchmarks/tables.tsv")
    conda:
        "../envs/python.yaml"
    params:
        source=source_hash("dragchain.tables"),
    shell:
        "dragchain tables $(dirname {input}) > {log} 2>&1"
