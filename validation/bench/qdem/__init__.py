"""QDEM beside scikit-fem and closed forms: the judge, problems that both solve, trials."""
