"""From raw outputs to the Parquet tables of a run."""
