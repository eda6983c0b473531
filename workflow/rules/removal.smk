# Load, sliding and friction work on the tool, facet by facet.


rule map_removal:
    input:
        multiext(
            of_process("tables/"),
            "rod_force.parquet",
            "rod_contacts.parquet",
        ),
        run=of_process("run.json"),
    output:
        multiext(
            of_process("tables/"),
            "facets.parquet",
            "contact_events.parquet",
            "removal.json",
            "rod.vtp",
        ),
        report(
            of_process("figures/rod.png"),
            caption="../report/rod.rst",
            category="Process",
            labels={"run": "{run}", "figure": "rod"},
        ),
    log:
        of_process("logs/removal.log"),
    benchmark:
        of_process("benchmarks/removal.tsv")
    conda:
        "../envs/python.yaml"
    params:
        source=source_hash("dragchain.removal", "dragchain.removal_figure"),
    shell:
        "dragchain removal $(dirname {input.run}) > {log} 2>&1"


# The same of a point of a plan; `measure_point` makes its tables.
rule map_removal_of_point:
    input:
        of_point("measures.json"),
    output:
        multiext(
            of_point("tables/"),
            "facets.parquet",
            "contact_events.parquet",
            "removal.json",
            "rod.vtp",
        ),
        of_point("figures/rod.png"),
    log:
        of_point("logs/removal.log"),
    benchmark:
        of_point("benchmarks/removal.tsv")
    conda:
        "../envs/python.yaml"
    params:
        source=source_hash("dragchain.removal", "dragchain.removal_figure"),
    shell:
        "dragchain removal $(dirname {input}) > {log} 2>&1"
