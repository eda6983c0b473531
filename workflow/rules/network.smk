# The interaction network and its chains.


rule find_chains:
    input:
        multiext(
            PROCESS + "tables/",
            "rod_force.parquet",
            "rod_contacts.parquet",
            "balls.parquet",
            "contacts.parquet",
        ),
        run=PROCESS + "run.json",
    output:
        PROCESS + "tables/network.parquet",
        PROCESS + "tables/chains.parquet",
    params:
        source=source_hash("dragchain.network", "dragchain.chains"),
    log:
        PROCESS + "logs/chains.log",
    benchmark:
        PROCESS + "benchmarks/chains.tsv"
    shell:
        "dragchain chains $(dirname {input.run}) > {log} 2>&1"
