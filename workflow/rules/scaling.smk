# The mean drag over one field of the study's sweep, and the power law in it.


rule write_scaling:
    input:
        WORK.every("process", "tables/quantities.json"),
    output:
        multiext(WORK.of_study("scaling", "scaling."), "csv", "json"),
        figure=shown(WORK.of_study("scaling", "scaling.png"), "scaling", "Scaling", "scaling"),
    resources:
        prints=1,
    params:
        runs=WORK.every_folder("process"),
        options=WORK.scaling_options,
        command=f"./run scaling --config study={STUDY}",
        source=source_hash("dragchain.scaling.fit"),
    shell:
        "dragchain step scaling --out $(dirname {output.figure}) {params.options}"
        " --command {params.command:q} -- {params.runs} 2>&1 | tee -i {log}"
