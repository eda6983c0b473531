# The frames of process runs for ParaView and OVITO.


rule export_paraview:
    input:
        multiext(
            of_process("tables/"),
            "rod_force.parquet",
            "balls.parquet",
            "contacts.parquet",
            "network.parquet",
            "chains.parquet",
        ),
        run=of_process("run.json"),
    output:
        of_process("export/paraview/run.pvd"),
    log:
        of_process("logs/export.log"),
    benchmark:
        of_process("benchmarks/export.tsv")
    conda:
        "../envs/python.yaml"
    params:
        source=source_hash("dragchain.export.writing"),
    shell:
        "dragchain export $(dirname {input.run}) --to paraview --replace > {log} 2>&1"
