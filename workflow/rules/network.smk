# The interaction network and its chains.


rule find_chains:
    input:
        multiext(
            of_process("tables/"),
            "rod_force.parquet",
            "rod_contacts.parquet",
            "balls.parquet",
            "contacts.parquet",
        ),
        run=of_process("run.json"),
    output:
        of_process("tables/network.parquet"),
        of_process("tables/chains.parquet"),
        of_process("tables/clusters.parquet"),
    log:
        of_process("logs/chains.log"),
    benchmark:
        of_process("benchmarks/chains.tsv")
    conda:
        "../envs/python.yaml"
    params:
        source=source_hash("dragchain.network", "dragchain.chains"),
    shell:
        "dragchain chains $(dirname {input.run}) > {log} 2>&1"
