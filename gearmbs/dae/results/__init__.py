"""Solutions of mechanisms: motions, reactions, loads, diagnostics and the energy balance."""
