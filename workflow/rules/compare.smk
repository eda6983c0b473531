# Cases of several studies, or of one sweep, side by side.


rule write_comparison:
    input:
        reports=lambda wildcards: [
            f"results/{study}/report/complete" for study in wildcards.studies.split("+")
        ],
        templates=WORK.page_templates("compare/compare.html.j2", "compare/networks.html.j2"),
    output:
        page="results/compare/{studies}/comparison.html",
        table="results/compare/{studies}/differences.csv",
    params:
        source=source_hash("dragchain.compare.report"),
    shell:
        "dragchain compare --out $(dirname {output.page}) $(dirname $(dirname {input.reports}))"
        " > {log} 2>&1"
