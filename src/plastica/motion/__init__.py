"""One model through time: the solver, the solution, the file it is kept in."""
