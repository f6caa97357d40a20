"""From a log-posterior to draws: search, proposal, ensembles, and what the draws say."""
