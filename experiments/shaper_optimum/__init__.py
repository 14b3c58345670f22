"""How near does the gradient-tuned free shaper come to the best shaper there is?"""
