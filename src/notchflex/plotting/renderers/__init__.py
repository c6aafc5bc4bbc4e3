"""Renderers of a picture: matplotlib for paper, plotly for the browser."""
