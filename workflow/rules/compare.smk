# Cases of several studies, or of one sweep, side by side.


rule write_comparison:
    input:
        lambda wildcards: [f"{study}/report/complete" for study in compared_folders(wildcards)],
        templates=WORK.page_templates("compare/compare.html.j2", "compare/networks.html.j2"),
    output:
        multiext("results/compare/{studies}/", "comparison.html", "differences.csv"),
    params:
        studies=lambda wildcards: compared_folders(wildcards),
        source=source_hash("dragchain.compare.report"),
    shell:
        "dragchain compare --out $(dirname {output[0]}) {params.studies} > {log} 2>&1"


def compared_folders(wildcards):
    """The results of the studies of a comparison."""
    return [f"results/{study}" for study in wildcards.studies.split("+")]


def comparison(_):
    """The page that compares the studies of this call."""
    if not config.get("studies"):
        raise WorkflowError(
            "no studies to compare\n  remedy: --config studies=A,B, or studies=A for the cases of a sweep"
        )
    return f"results/compare/{'+'.join(STUDIES)}/comparison.html"
