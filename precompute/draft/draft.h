// Draft of a model.toml for a surface, an image or a picture.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "precompute/draft/length_unit.h"
#include "precompute/draft/shape.h"

namespace palpate {

/// Values of a drafted model.toml besides the shape. Defaults are those of soft tissue: E and nu of healthy
/// liver, rounded (Roulot et al., J. Hepatology 48, 2008: 5.5 +- 1.6 kPa), density and friction as the liver
/// of meshes/models. A plane body is not held.
struct DraftValues {
  std::string name;              ///< empty: name of the file
  double youngs_modulus = 5e3;   ///< [Pa]
  double poissons_ratio = 0.45;  ///< [-]
  double density = 1060.0;       ///< [kg/m^3]
  double friction = 0.2;         ///< [-]
  char down = 'z';               ///< axis along which the lowest nodes are held
  double percent = 10.0;         ///< held fraction of the extent along it
};

/// Options of a draft.
struct DraftOptions {
  ShapeOptions shape{};
  std::optional<LengthUnit> unit{};     ///< empty: guessed
  bool renew = false;                   ///< an existing description is replaced
  bool tet10 = false;                   ///< second-order elements, else tet4a; pictures have tri3
  std::filesystem::path elsewhere{};    ///< folder for files that the shape's own folder cannot hold
  bool keep = false;                    ///< no existing file is replaced
  std::optional<DraftValues> values{};  ///< empty: defaults of the kind
};

/// Default values: soft tissue; for pictures jelly, E = 20 kPa and nu = 0.3, which keeps its shape under its
/// own weight.
DraftValues usual_values(ShapeKind kind);

/// Prints a line for the user.
using Tell = std::function<void(const std::string&)>;

/// File of a shape's description: "organ.model.toml" beside "organ.stl"; in the folder `elsewhere` if there
/// is none beside it and that folder is read-only.
std::filesystem::path draft_file(const std::filesystem::path& shape,
                                 const std::filesystem::path& elsewhere = {});

/// Text of the description in the file `description` for a shape in `file` (if repaired, in `repaired`, a
/// name in the description's folder). `unit`: its unit and the reason for it.
std::string draft_text(const std::filesystem::path& description, const std::filesystem::path& file,
                       const std::string& repaired, const Shape& shape, const UnitGuess& unit,
                       const DraftOptions& options);

/// Writes the description of a shape to draft_file and beside it a repaired surface as NAME.repaired.off
/// (with `keep` NAME.repaired-2.off if that exists, and so on), and returns the description's file. An
/// existing description is used as it is; each decision goes to `tell`. Throws Error for a file that cannot
/// be used; for options that would change an existing description and for one made from another file, unless
/// `renew`; and if it cannot be written.
std::filesystem::path draft(const std::filesystem::path& file, const DraftOptions& options, bool has_options,
                            const Tell& tell);

}  // namespace palpate
