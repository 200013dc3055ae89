"""Force elements, one file a kind: what is packed, the compiled law, the reference law, channels; see `registry`."""
