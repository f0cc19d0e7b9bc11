"""What an equilibrium tells: poses, actuation loads, stability, rates; each computed when first asked for.

Uses the kernel, and the seed's full model for answers at that level.
"""
