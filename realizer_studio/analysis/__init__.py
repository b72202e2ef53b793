"""Analysis of faces: FAPs from points and meshes, recognised emotions, search by picture."""
