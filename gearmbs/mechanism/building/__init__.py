"""From a mechanism to the arrays that the equations are evaluated from."""
