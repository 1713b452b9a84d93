"""The verbs of ``trackbed`` about settlement; what a verb computes with is loaded when it runs."""
