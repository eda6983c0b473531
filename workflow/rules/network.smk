# The interactive page on the contact network of each process run.


rule write_network_page:
    input:
        tables_of("process", [*SCENES["process"].tables, *SCENES["process"].network]),
        of_run("process", "tables/facets.parquet"),
        WORK.page_files("network_page/network.*"),
        run=of_run("process", "run.json"),
    output:
        shown(of_run("process", "network.html"), "network", "Process", "network", run="{run}"),
    params:
        source=source_hash("dragchain.network_page.page"),
    shell:
        "dragchain network $(dirname {output}) > {log} 2>&1"
