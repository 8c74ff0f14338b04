// model.toml: the user's description of a body. docs/model-toml.md documents the keys.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "formats/model.h"
#include "meshes/generate.h"
#include "meshes/selection.h"

namespace palpate {

/// Closed triangle surface (OFF, OBJ, STL, PLY).
struct SurfaceGeometry {
  std::filesystem::path file;
};

/// Values of an image from `low` to `high`.
struct ValueRange {
  double low, high;
};

/// Labelled image (INR, NIfTI, NRRD). Every non-zero label is body, unless `labels` lists the ones that are
/// or, for a grey image, `range` gives the values that are. With `regions` the elements keep their label as
/// region and the mesh follows the interfaces between labels.
struct ImageGeometry {
  std::filesystem::path file;
  std::vector<int> labels;            ///< empty: all non-zero ones
  bool regions = false;               ///< labels are materials: some [[material]] has regions
  std::optional<ValueRange> range{};  ///< values of the body, a single tissue
};

/// Mesh made by another program (.msh, .mesh, .node/.ele, .vtk), in any case of letters.
struct VolumeGeometry {
  std::filesystem::path file;
};

/// Polygon in the plane [geometry units]: the outer line and holes, in either sense, not closed twice.
struct PolygonGeometry {
  std::vector<Vec3> points;
  std::vector<std::vector<Vec3>> holes;
};

/// Black-and-white picture (PNG, PBM): the body is the pixels that are not black (Sito), or with `dark` the
/// black ones. A pixel is a square of one geometry unit; x to the right, y up, the lower left corner of the
/// picture at the origin.
struct PictureGeometry {
  std::filesystem::path file;
  bool dark = false;  ///< the body is black
};

using Geometry = std::variant<SurfaceGeometry, ImageGeometry, VolumeGeometry, PolygonGeometry,
                              PictureGeometry, RectangleShape, BoxShape, CylinderShape, SphereShape>;

enum class Mesher : std::uint8_t { tetgen, cgal };

/// Options for meshing. Lengths in metres after scaling.
struct MeshOptions {
  /// Kind of the elements; by default tet4a; quad4 for rectangles; tri3 for polygons and pictures; empty: a
  /// volume mesh's own.
  std::optional<ElementType> element;
  Mesher mesher = Mesher::tetgen;  ///< for surfaces and images; images: cgal by default
  bool mesher_chosen = false;      ///< named in model.toml: no other mesher replaces it
  /// Target length at the boundary [m]. Required for images, polygons, pictures and with remesh; otherwise
  /// the mean edge of the surface.
  std::optional<double> edge_length;
  bool remesh = false;   ///< surfaces: isotropic remeshing to edge_length before meshing
  double grading = 0.5;  ///< growth of the target edge length per length below the boundary [-]; 0 is uniform
  double radius_edge = 2.0;     ///< bound on circumradius / shortest edge [-]; not for plane meshes
  double min_dihedral = 10.0;   ///< tetgen: bound passed to TetGen [degree]
  double facet_distance = 0.0;  ///< cgal: boundary approximation error [m]; 0: images, the largest side of a
                                ///< voxel; surfaces, a twentieth of edge_length
  double feature_angle = 60.0;  ///< cgal on surfaces: edges with a larger angle between their faces are kept
                                ///< [degree]; 180: none
  bool odt = false;             ///< cgal: global optimisation by optimal Delaunay triangulation
  bool lloyd = false;           ///< cgal: global optimisation by centroidal Voronoi (and of plane meshes)
  bool perturb = true;          ///< cgal: sliver perturbation, after odt or lloyd
  bool exude = true;            ///< cgal: sliver exudation, last
};

/// Nodes held along some axes, at a prescribed displacement.
struct Fixing {
  Selection where;
  std::uint8_t axes = 7;             ///< bit `axis` is set if held
  Vec3 displacement = Vec3::Zero();  ///< along the held axes [m]
};

/// A material and its elements: those of its regions, by number or by the mesh file's names, those in its
/// selection, or (none given) those that no other material claims.
struct MaterialPart {
  Material material;
  std::vector<Index> regions;
  std::optional<Selection> where;
  std::vector<std::string> region_names{};
};

/// Force on each of some nodes [N].
struct ConcentratedForce {
  Vec3 force;
  Selection where;
};
/// Force per area [N/m^2] on the boundary facets with the tag, or whose nodes are all selected; in the plane
/// it acts over the thickness.
struct Traction {
  Vec3 traction;
  Selection where;
};
/// Body force: acceleration [m/s^2] times each material's density.
struct Gravity {
  Vec3 acceleration;
};
using Load = std::variant<ConcentratedForce, Traction, Gravity>;

/// Overlays condensed in advance: one around each surface node in the regions.
struct OverlayRegions {
  int refinement = 3;  ///< each element is cut into r^d
  int rings = 2;       ///< of elements around the node
  std::vector<Selection> regions;
};

/// Options for dynamics.
struct DynamicsOptions {
  std::optional<DynamicsMethod> method;  ///< packed or modal; empty: the one that fits
  bool lumped = false;                   ///< M is diagonal
  Newmark newmark;
  Rayleigh damping;
  std::optional<Index> modes;  ///< modal: number of modes; empty: 100, or all if there are fewer
  std::string place;           ///< place of `modes`, else of the table: file, line and column, for errors
};

/// Storage form of the Green's functions.
enum class StorageForm : std::uint8_t {
  automatic,   ///< compressed if there are many stored nodes
  packed,      ///< every entry
  compressed,  ///< in nested low-rank form, H^2
};

/// The whole model.toml, checked.
struct Description {
  std::filesystem::path file;  ///< model.toml itself
  std::string text;            ///< its bytes
  std::string name;
  Geometry geometry;
  double scale = 1.0;  ///< metres per length unit of the geometry
  MeshOptions mesh;
  Analysis analysis = Analysis::solid;
  double thickness = 1.0;  ///< in the plane [m]
  std::vector<MaterialPart> materials;
  std::vector<Fixing> fixed;
  std::vector<Load> loads;
  Scope scope = Scope::layers;
  Index layers = 1;
  std::optional<Precision> precision;  ///< empty: the first that is accurate enough (precision.h)
  StorageForm form = StorageForm::automatic;
  double tolerance = 0.005;  ///< compressed: largest allowed force error, relative to the largest force [-]
  std::optional<OverlayRegions> overlay;
  std::optional<DynamicsOptions> dynamics;
};

}  // namespace palpate
