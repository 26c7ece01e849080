"""Runs made elsewhere: STAR-CCM+ monitors, OpenFOAM forces, CSV, netCDF and MAT files, converted at the gate."""
