"""Figures, 3-D views, animations and geometry files.

Everything public is importable from here; a module, and matplotlib with it, is loaded when first asked for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from gearmbs._lazy import late

if TYPE_CHECKING:
    from gearmbs.view.animation import MeshAnimation, mesh_animation
    from gearmbs.view.bars import comparison_bars, gmf_bars
    from gearmbs.view.bearing_figure import bearing_plot
    from gearmbs.view.campbell_figure import campbell_plot
    from gearmbs.view.changing_speed import (
        changing_speed_figures,
        order_map_plot,
        order_track_plot,
        spectrogram_plot,
        waterfall_plot,
    )
    from gearmbs.view.contacts import ContactPoints, ContactProbe
    from gearmbs.view.curves import contact_pattern_plot, load_sharing_plot, stiffness_plot, transmission_error_plot
    from gearmbs.view.export_dxf import write_dxf
    from gearmbs.view.export_step import write_step
    from gearmbs.view.export_stl import read_stl, write_stl
    from gearmbs.view.figure_style import COLOURS, save_figure
    from gearmbs.view.flexible_bodies import (
        BodyAnimation,
        deformation_animation,
        deformed_plot,
        modal_energy_plot,
        mode_animation,
        whirl_plot,
    )
    from gearmbs.view.maps import sensitivity_map
    from gearmbs.view.mesh import Mesh
    from gearmbs.view.motion import PairMotion, solution_motion, static_motion
    from gearmbs.view.named_lines import named_lines_plot
    from gearmbs.view.outline import gear_outline, profile_area
    from gearmbs.view.page import Page
    from gearmbs.view.planetary import planetary_plot, planetary_scene
    from gearmbs.view.reports import analysis_figures, comparison_figures, report_plot
    from gearmbs.view.revolution import average_plot
    from gearmbs.view.scene import Deflection, Part, Scene
    from gearmbs.view.scenes import gear_scene, mechanism_scene, solution_scene
    from gearmbs.view.signals import order_plot, spectrum_plot, time_plot
    from gearmbs.view.solid import gear_solid, pair_solids
    from gearmbs.view.solution_figures import solution_plot
    from gearmbs.view.stress_figure import stress_plot
    from gearmbs.view.topology import mechanism_plot
    from gearmbs.view.transverse import mesh_view
    from gearmbs.view.wheel import wheel_plot

__all__ = [
    "COLOURS",
    "BodyAnimation",
    "ContactPoints",
    "ContactProbe",
    "Deflection",
    "Mesh",
    "MeshAnimation",
    "Page",
    "PairMotion",
    "Part",
    "Scene",
    "analysis_figures",
    "average_plot",
    "bearing_plot",
    "campbell_plot",
    "changing_speed_figures",
    "comparison_bars",
    "comparison_figures",
    "contact_pattern_plot",
    "deformation_animation",
    "deformed_plot",
    "gear_outline",
    "gear_scene",
    "gear_solid",
    "gmf_bars",
    "load_sharing_plot",
    "mechanism_plot",
    "mechanism_scene",
    "mesh_animation",
    "mesh_view",
    "modal_energy_plot",
    "mode_animation",
    "named_lines_plot",
    "order_map_plot",
    "order_plot",
    "order_track_plot",
    "pair_solids",
    "planetary_plot",
    "planetary_scene",
    "profile_area",
    "read_stl",
    "report_plot",
    "save_figure",
    "sensitivity_map",
    "solution_motion",
    "solution_plot",
    "solution_scene",
    "spectrogram_plot",
    "spectrum_plot",
    "static_motion",
    "stiffness_plot",
    "stress_plot",
    "time_plot",
    "transmission_error_plot",
    "waterfall_plot",
    "wheel_plot",
    "whirl_plot",
    "write_dxf",
    "write_step",
    "write_stl",
]

late(
    __name__,
    {
        "deformed_plot": ".flexible_bodies",
        "deformation_animation": ".flexible_bodies",
        "mode_animation": ".flexible_bodies",
        "modal_energy_plot": ".flexible_bodies",
        "stress_plot": ".stress_figure",
        "whirl_plot": ".flexible_bodies",
        "BodyAnimation": ".flexible_bodies",
        "Deflection": ".scene",
        "COLOURS": ".figure_style",
        "ContactPoints": ".contacts",
        "ContactProbe": ".contacts",
        "Mesh": ".mesh",
        "MeshAnimation": ".animation",
        "Page": ".page",
        "PairMotion": ".motion",
        "Part": ".scene",
        "Scene": ".scene",
        "analysis_figures": ".reports",
        "average_plot": ".revolution",
        "bearing_plot": ".bearing_figure",
        "campbell_plot": ".campbell_figure",
        "changing_speed_figures": ".changing_speed",
        "comparison_bars": ".bars",
        "comparison_figures": ".reports",
        "contact_pattern_plot": ".curves",
        "gear_outline": ".outline",
        "gear_scene": ".scenes",
        "gear_solid": ".solid",
        "gmf_bars": ".bars",
        "planetary_plot": ".planetary",
        "planetary_scene": ".planetary",
        "load_sharing_plot": ".curves",
        "mechanism_plot": ".topology",
        "mechanism_scene": ".scenes",
        "mesh_animation": ".animation",
        "mesh_view": ".transverse",
        "named_lines_plot": ".named_lines",
        "order_map_plot": ".changing_speed",
        "order_plot": ".signals",
        "order_track_plot": ".changing_speed",
        "pair_solids": ".solid",
        "profile_area": ".outline",
        "read_stl": ".export_stl",
        "report_plot": ".reports",
        "save_figure": ".figure_style",
        "sensitivity_map": ".maps",
        "solution_plot": ".solution_figures",
        "solution_motion": ".motion",
        "solution_scene": ".scenes",
        "spectrogram_plot": ".changing_speed",
        "spectrum_plot": ".signals",
        "static_motion": ".motion",
        "stiffness_plot": ".curves",
        "time_plot": ".signals",
        "transmission_error_plot": ".curves",
        "waterfall_plot": ".changing_speed",
        "wheel_plot": ".wheel",
        "write_dxf": ".export_dxf",
        "write_step": ".export_step",
        "write_stl": ".export_stl",
    },
)
