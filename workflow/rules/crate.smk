# A study's inputs, runs and report as an RO-Crate, to archive and to cite.


rule write_crate:
    input:
        [WORK.every(name, "run.json", "tables/findings.json") for name in SCENES],
        # A brace would start a wildcard.
        lambda wildcards: [file for file in WORK.crate_inputs() if "{" not in file],
        report=WORK.report,
    output:
        WORK.of_study("crate", "ro-crate-metadata.json"),
    params:
        runs=[folder for name in SCENES for folder in WORK.every_folder(name)],
        licence=WORK.licence_option,
        files=lambda wildcards: " ".join(map(quote, WORK.crate_inputs())),
        source=source_hash("dragchain.report.crate"),
    shell:
        "dragchain step crate --out $(dirname {output}) --report $(dirname {input.report[0]})"
        " {params.licence} --inputs {params.files} -- {params.runs} > {log} 2>&1"
