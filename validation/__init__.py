"""Cases with known answers: ``python -m validation CASE`` measures trackbed against them."""
