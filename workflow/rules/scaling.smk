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
        study=STUDY,
        asked=lambda wildcards: or_stop(scaling_of, CASES[0]).model_dump_json(),
        command=f"./run scaling --config study={STUDY}",
        source=source_hash("dragchain.scaling.fit"),
    shell:
        "dragchain step scaling {params.study} --out $(dirname {output.figure})"
        " --command {params.command:q} -- {params.runs} 2>&1 | tee -i {log}"
