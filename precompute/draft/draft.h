// A model.toml for a surface, an image or a picture.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "precompute/draft/length_unit.h"
#include "precompute/draft/shape.h"

namespace palpate {

/// What a drafted model.toml says besides the shape. Defaults are those of soft tissue: E and nu of healthy
/// liver, rounded (Roulot et al., J. Hepatology 48, 2008: 5.5 +- 1.6 kPa), density and friction as the liver
/// of meshes/models. Nothing holds a body in the plane.
struct DraftValues {
  std::string name;              ///< empty: that of the file
  double youngs_modulus = 5e3;   ///< [Pa]
  double poissons_ratio = 0.45;  ///< [-]
  double density = 1060.0;       ///< [kg/m^3]
  double friction = 0.2;         ///< [-]
  char down = 'z';               ///< axis along which the lowest nodes are held
  double percent = 10.0;         ///< of the extent along it that is held
};

/// How a draft is made.
struct DraftOptions {
  ShapeOptions shape{};
  std::optional<LengthUnit> unit{};     ///< empty: guessed
  bool renew = false;                   ///< a description that is there is written anew
  bool tet10 = false;                   ///< elements of second order; else tet4. Of pictures tri3
  std::filesystem::path elsewhere{};    ///< folder for what the shape's own folder cannot take
  bool keep = false;                    ///< else no file that is there is replaced
  std::optional<DraftValues> values{};  ///< empty: the usual ones of the kind
};

/// Soft tissue; for pictures jelly, E = 20 kPa and nu = 0.3, which keeps its shape under its own weight.
DraftValues usual_values(ShapeKind kind);

/// Takes a line for a person.
using Tell = std::function<void(const std::string&)>;

/// The description that belongs to a shape: "organ.model.toml" beside "organ.stl"; in the folder `elsewhere`
/// where there is none beside it and that folder may only be read.
std::filesystem::path draft_file(const std::filesystem::path& shape,
                                 const std::filesystem::path& elsewhere = {});

/// The text of a description in the file `description` of a shape in `file` (where repaired, in `repaired`, a
/// name in the description's folder). `unit` is what its unit is and why.
std::string draft_text(const std::filesystem::path& description, const std::filesystem::path& file,
                       const std::string& repaired, const Shape& shape, const UnitGuess& unit,
                       const DraftOptions& options);

/// Writes the description of a shape, draft_file, and beside it a surface that was repaired as
/// NAME.repaired.off (with `keep` NAME.repaired-2.off where that is there, and so on), and returns the
/// description's file. A description that is there already is used as it is; each decision is told. Throws
/// Error for a file that cannot be used, for options that would change a description that is there and for
/// one that was made from another file, unless `renew`, and where it cannot be written.
std::filesystem::path draft(const std::filesystem::path& file, const DraftOptions& options, bool has_options,
                            const Tell& tell);

}  // namespace palpate
