"""The filter descriptors, one XML file a filter; data of the package meshlab_specsmooth."""
