# The interactive page on the contact network of each process run.


rule write_network_page:
    input:
        tables_of("process", [*SCENES["process"].tables, *SCENES["process"].network]),
        of_run("process", "tables/facets.parquet"),
        WORK.files("analysis/dragchain/network_page/network.*"),
        run=of_run("process", "run.json"),
    output:
        report(
            of_run("process", "network.html"),
            caption="../report/network.rst",
            category="Process",
            labels={"run": "{run}", "figure": "network"},
        ),
    params:
        source=source_hash("dragchain.network_page.page"),
    shell:
        "dragchain network $(dirname {output}) > {log} 2>&1"
