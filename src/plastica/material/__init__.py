"""The material: three laws as text, their exact derivatives, and the hypotheses they must satisfy."""
