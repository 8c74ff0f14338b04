// model.toml: what a person writes to describe a body. Keys are documented in docs/model-toml.md.
#pragma once

#include <filesystem>
#include <numbers>
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

/// Labelled image (INR, NIfTI, NRRD). Every non-zero label is body unless `labels` lists those that are, or
/// of a grey image `range` says which values are. With `regions` the elements keep their label as region and
/// the mesh follows the interfaces between labels.
struct ImageGeometry {
  std::filesystem::path file;
  std::vector<int> labels;            ///< empty: all non-zero ones
  bool regions = false;               ///< labels are materials: some [[material]] has regions
  std::optional<ValueRange> range{};  ///< these values are the body, a single tissue
};

/// Mesh made elsewhere (.msh, .mesh, .node/.ele, .vtk), in any case of letters.
struct VolumeGeometry {
  std::filesystem::path file;
};

/// Polygon in the plane [geometry units]: the outer line and holes, in either sense, not closed twice.
struct PolygonGeometry {
  std::vector<Vec3> points;
  std::vector<std::vector<Vec3>> holes;
};

/// Black-and-white picture (PNG, PBM): the pixels that are not black are the body (Sito), or those that are.
/// A pixel is a square of one geometry unit; x to the right, y up, the lower left corner of the picture at
/// the origin.
struct PictureGeometry {
  std::filesystem::path file;
  bool dark = false;  ///< what is black is the body
};

using Geometry = std::variant<SurfaceGeometry, ImageGeometry, VolumeGeometry, PolygonGeometry,
                              PictureGeometry, RectangleShape, BoxShape, CylinderShape, SphereShape>;

enum class Mesher : std::uint8_t { tetgen, cgal };

/// How the body is meshed. Lengths in metres after scaling.
struct MeshOptions {
  /// Kind of the elements; empty: the natural one of the geometry (tet4; quad4 for rectangles; tri3 for
  /// polygons and pictures; what the file has).
  std::optional<ElementType> element;
  Mesher mesher = Mesher::tetgen;  ///< surfaces and images; images: cgal unless told otherwise
  bool mesher_chosen = false;      ///< model.toml names it: another one does not take its place
  /// Target at the boundary [m]. Required for images, polygons, pictures and with remesh; otherwise the mean
  /// edge of the surface.
  std::optional<double> edge_length;
  bool remesh = false;   ///< surfaces: isotropic remeshing to edge_length before meshing
  double grading = 0.5;  ///< growth of the target edge length per length below the boundary [-]; 0 is uniform
  double radius_edge = 2.0;     ///< bound on circumradius / shortest edge [-]; not for plane meshes
  double min_dihedral = 10.0;   ///< tetgen: bound asked of TetGen [degree]
  double facet_distance = 0.0;  ///< cgal: boundary approximation error [m]; 0: images, the largest side of a
                                ///< voxel; surfaces, a twentieth of edge_length
  double feature_angle =
      60.0;             ///< cgal on surfaces: edges whose faces turn by more are kept [degree]; 180: none
  bool odt = false;     ///< cgal: global optimisation by optimal Delaunay triangulation
  bool lloyd = false;   ///< cgal: global optimisation by centroidal Voronoi (and of plane meshes)
  bool perturb = true;  ///< cgal: sliver perturbation, after odt or lloyd
  bool exude = true;    ///< cgal: sliver exudation, last
};

/// Nodes held along some axes, at a prescribed displacement.
struct Fixing {
  Selection where;
  std::uint8_t axes = 7;             ///< bit `axis` is set where held
  Vec3 displacement = Vec3::Zero();  ///< along the held axes [m]
};

/// A material and the elements that are made of it: those of its regions, by number or by the names that the
/// mesh file gives them, those that its selection holds, or (none given) those that no other material claims.
struct MaterialPart {
  Material material;
  std::vector<Index> regions;
  std::optional<Selection> where;
  std::vector<std::string> region_names{};
};

/// Force on each of some nodes [N].
struct NodalForce {
  Vec3 force;
  Selection where;
};
/// Force per area [N/m^2] on the boundary facets that have the tag, or all of whose nodes are selected; in
/// the plane it acts over the thickness.
struct Traction {
  Vec3 traction;
  Selection where;
};
/// Body force: acceleration [m/s^2] times each material's density.
struct Gravity {
  Vec3 acceleration;
};
using Load = std::variant<NodalForce, Traction, Gravity>;

/// Overlays that are condensed ahead: one round each surface node in the regions.
struct OverlayRegions {
  int refinement = 3;  ///< each element is cut into r^d
  int rings = 2;       ///< of elements round the node
  std::vector<Selection> regions;
};

/// Swinging after the body is let go.
struct DynamicsOptions {
  std::optional<DynamicsMethod> method;  ///< packed or modal; empty: what fits
  bool lumped = false;                   ///< M is diagonal
  Newmark newmark;
  Rayleigh damping;
  std::optional<Index> modes;  ///< modal: how many; empty: 100, or all where there are fewer
  std::string place;           ///< of `modes`, else of the table: file, line and column, for errors
};

/// A study of how far the body may turn until small strain and warping are wrong.
struct WarpOptions {
  std::optional<Selection> where;         ///< what is loaded; empty: the free end
  std::optional<Vec3> direction;          ///< of the force at rest; empty: along which that gives way most
  double angle = 0.5 * std::numbers::pi;  ///< rotation of the surface at which it ends [rad]
  Index levels = 12;                      ///< of the force until then, about
  std::string place;                      ///< of the table: file, line and column, for errors
};

/// How the Green's functions are stored.
enum class StorageForm : std::uint8_t {
  automatic,   ///< compressed where there are many stored nodes
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
  std::optional<Precision> precision;  ///< empty: the first that is good enough (precision.h)
  StorageForm form = StorageForm::automatic;
  double tolerance = 0.005;  ///< compressed: most that forces may be off, relative to the largest [-]
  std::optional<OverlayRegions> overlay;
  std::optional<DynamicsOptions> dynamics;
  std::optional<WarpOptions> warp;
};

}  // namespace palpate
