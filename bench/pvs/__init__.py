"""The seed's full model: its insertion forces beside those of virtual work."""
