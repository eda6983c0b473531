# Tables: raw engine output to Parquet.


rule tabulate_drop:
    input:
        DROP + "run.json",
    output:
        DROP + "tables/impacts.parquet",
    params:
        source=source_hash("dragchain.tables"),
    log:
        DROP + "logs/tables.log",
    benchmark:
        DROP + "benchmarks/tables.tsv"
    shell:
        "dragchain tables $(dirname {input}) > {log} 2>&1"


rule tabulate_fill:
    input:
        FILL + "run.json",
    output:
        FILL + "tables/fill.json",
        FILL + "tables/thermo.parquet",
    params:
        source=source_hash("dragchain.tables"),
    log:
        FILL + "logs/tables.log",
    benchmark:
        FILL + "benchmarks/tables.tsv"
    shell:
        "dragchain tables $(dirname {input}) > {log} 2>&1"


rule tabulate_process:
    input:
        PROCESS + "run.json",
    output:
        multiext(
            PROCESS + "tables/",
            "thermo.parquet",
            "rod_force.parquet",
            "rod_contacts.parquet",
            "balls.parquet",
            "contacts.parquet",
            "closure.json",
        ),
    params:
        source=source_hash("dragchain.tables"),
    log:
        PROCESS + "logs/tables.log",
    benchmark:
        PROCESS + "benchmarks/tables.tsv"
    shell:
        "dragchain tables $(dirname {input}) > {log} 2>&1"
