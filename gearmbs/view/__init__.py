"""Figures, 3-D views, animations and geometry files.

Everything public is importable from here; a module, and matplotlib with it, is loaded when first asked for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from gearmbs._lazy import late

if TYPE_CHECKING:
    from gearmbs.view.figures.animation import MeshAnimation, mesh_animation
    from gearmbs.view.figures.bodies import (
        BodyAnimation,
        campbell_plot,
        deformation_animation,
        deformed_plot,
        modal_energy_plot,
        mode_animation,
        solution_plot,
        stress_plot,
        whirl_plot,
    )
    from gearmbs.view.figures.changing_speed import (
        changing_speed_figures,
        order_map_plot,
        order_track_plot,
        spectrogram_plot,
        waterfall_plot,
    )
    from gearmbs.view.figures.curves import (
        contact_pattern_plot,
        load_sharing_plot,
        stiffness_plot,
        transmission_error_plot,
    )
    from gearmbs.view.figures.maps import sensitivity_map
    from gearmbs.view.figures.records import average_plot, named_lines_plot, order_plot, spectrum_plot, time_plot
    from gearmbs.view.figures.reports import analysis_figures, bearing_plot, comparison_figures, report_plot
    from gearmbs.view.figures.style import COLOURS, comparison_bars, gmf_bars, save_figure
    from gearmbs.view.figures.transverse import mechanism_plot, mesh_view, wheel_plot
    from gearmbs.view.geometry.flat import read_stl, write_dxf, write_stl
    from gearmbs.view.geometry.mesh import Mesh
    from gearmbs.view.geometry.profile import gear_outline, profile_area
    from gearmbs.view.geometry.solid import gear_solid, pair_solids
    from gearmbs.view.geometry.step import write_step
    from gearmbs.view.scenes.motion import ContactPoints, ContactProbe, PairMotion, solution_motion, static_motion
    from gearmbs.view.scenes.pages import Page
    from gearmbs.view.scenes.scene import Deflection, Part, Scene
    from gearmbs.view.scenes.scenes import gear_scene, mechanism_scene, planetary_plot, planetary_scene, solution_scene

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
        "deformed_plot": ".figures.bodies",
        "deformation_animation": ".figures.bodies",
        "mode_animation": ".figures.bodies",
        "modal_energy_plot": ".figures.bodies",
        "stress_plot": ".figures.bodies",
        "whirl_plot": ".figures.bodies",
        "BodyAnimation": ".figures.bodies",
        "Deflection": ".scenes.scene",
        "COLOURS": ".figures.style",
        "ContactPoints": ".scenes.motion",
        "ContactProbe": ".scenes.motion",
        "Mesh": ".geometry.mesh",
        "MeshAnimation": ".figures.animation",
        "Page": ".scenes.pages",
        "PairMotion": ".scenes.motion",
        "Part": ".scenes.scene",
        "Scene": ".scenes.scene",
        "analysis_figures": ".figures.reports",
        "average_plot": ".figures.records",
        "bearing_plot": ".figures.reports",
        "campbell_plot": ".figures.bodies",
        "changing_speed_figures": ".figures.changing_speed",
        "comparison_bars": ".figures.style",
        "comparison_figures": ".figures.reports",
        "contact_pattern_plot": ".figures.curves",
        "gear_outline": ".geometry.profile",
        "gear_scene": ".scenes.scenes",
        "gear_solid": ".geometry.solid",
        "gmf_bars": ".figures.style",
        "planetary_plot": ".scenes.scenes",
        "planetary_scene": ".scenes.scenes",
        "load_sharing_plot": ".figures.curves",
        "mechanism_plot": ".figures.transverse",
        "mechanism_scene": ".scenes.scenes",
        "mesh_animation": ".figures.animation",
        "mesh_view": ".figures.transverse",
        "named_lines_plot": ".figures.records",
        "order_map_plot": ".figures.changing_speed",
        "order_plot": ".figures.records",
        "order_track_plot": ".figures.changing_speed",
        "pair_solids": ".geometry.solid",
        "profile_area": ".geometry.profile",
        "read_stl": ".geometry.flat",
        "report_plot": ".figures.reports",
        "save_figure": ".figures.style",
        "sensitivity_map": ".figures.maps",
        "solution_plot": ".figures.bodies",
        "solution_motion": ".scenes.motion",
        "solution_scene": ".scenes.scenes",
        "spectrogram_plot": ".figures.changing_speed",
        "spectrum_plot": ".figures.records",
        "static_motion": ".scenes.motion",
        "stiffness_plot": ".figures.curves",
        "time_plot": ".figures.records",
        "transmission_error_plot": ".figures.curves",
        "waterfall_plot": ".figures.changing_speed",
        "wheel_plot": ".figures.transverse",
        "write_dxf": ".geometry.flat",
        "write_step": ".geometry.step",
        "write_stl": ".geometry.flat",
    },
)
