# A search goes on round by round. A run that fails is a finding: the rounds after it go on without it.


# The settings of a round, which are cases of the study from then on; the last round has none.
checkpoint choose_settings:
    input:
        WORK.known_of_search,
    output:
        "results/{study}/search/round-{round}.json",
    localrule: True
    resources:
        prints=1,
    params:
        asked=WORK.asked_of_search,
        source=source_hash("dragchain.search.report"),
    shell:
        "dragchain step search {wildcards.study} {wildcards.round} --out {output} 2>&1 | tee -i {log}"


# All runs of a round have ended: what else is made of them depends on how.
checkpoint try_settings:
    input:
        WORK.ended_of_round,
    output:
        touch("results/{study}/search/tried-{round}"),
    localrule: True
