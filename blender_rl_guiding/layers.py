"""The passes of a render beside its image. The add-on imports this, too."""

# Name, as in Cycles -> names of its channels in files.
LAYERS = {
    "Albedo": "RGB",
    "Normal": "XYZ",
    "Depth": "Z",
    "Position": "XYZ",
    "Emission": "RGB",
    "Direct": "RGB",
    "Indirect": "RGB",
    "Variance": "RGB",
    "Sample Count": "X",
}
