"""What a picture or a page shows, as arrays: pyvista draws them in `pictures`, WebGL from the data of `viewer`."""
