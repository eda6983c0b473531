# The frames of process runs for ParaView and OVITO.


rule export_paraview:
    input:
        tables_of("process", [*SCENES["process"].tables, *SCENES["process"].network]),
        of_run("process", "tables/facets.parquet"),
        run=of_run("process", "run.json"),
    output:
        of_run("process", "export/paraview/run.pvd"),
    params:
        source=source_hash("dragchain.export.write"),
    shell:
        "dragchain export $(dirname {input.run}) --replace > {log} 2>&1"
