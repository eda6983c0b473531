# A study's inputs, runs and report as an RO-Crate, to archive and to cite.


rule write_crate:
    input:
        [every(name, "run.json", "tables/figures.json") for name in SCENES],
        # A brace would start a wildcard.
        lambda wildcards: [file for file in crate_inputs() if "{" not in file],
        report=rules.write_report.output,
    output:
        of_study("crate", "ro-crate-metadata.json"),
    log:
        of_study("logs", "crate.log"),
    benchmark:
        of_study("benchmarks", "crate.tsv")
    conda:
        "../envs/python.yaml"
    params:
        runs=[folder for name in SCENES for folder in every_folder(name)],
        licence=licence_option,
        files=lambda wildcards: " ".join(map(quote, crate_inputs())),
        source=source_hash("dragchain.report.crate"),
    shell:
        "dragchain step crate --out $(dirname {output}) --report $(dirname {input.report[0]})"
        " {params.licence} --inputs {params.files} -- {params.runs} > {log} 2>&1"
