#include "precompute/description/not_a_description.h"

#include <fmt/format.h>

#include <string>
#include <string_view>

#include "base/error.h"
#include "base/printable.h"
#include "base/regular_file.h"
#include "base/toml_text.h"
#include "formats/file_kinds.h"

namespace palpate {
namespace {

std::string first_description(const std::filesystem::path& file, std::string_view key) {
  const bool plane = key == "picture";
  std::string text = "    name = " + toml_string(name_without_ending(file)) + "\n";
  if (plane) text += "    plane = \"stress\"\n    thickness = 0.001    # metres\n";
  text += "    [geometry]\n    " + std::string(key) + " = " + toml_string(file.filename().string()) + "\n";
  text += plane ? "    scale = 0.001    # metres per pixel\n"
                : "    scale = 0.001    # metres per unit of the file: 0.001 for millimetres, 1 for metres\n";
  if (plane || key == "image")
    text += "    [mesh]\n    edge_length = 0.01    # metres, of the elements at the boundary\n";
  text += "    [material]\n    youngs_modulus = 5e3    # pascals: soft tissue\n    poissons_ratio = 0.45\n";
  text +=
      std::string("    [[fixed]]    # what is held: the lowest tenth of the body\n    lowest = {axis = ") +
      (plane ? "\"y\"" : "\"z\"") + ", percent = 10}";
  return text;
}

}  // namespace

void check_is_description(const std::filesystem::path& path) {
  const std::string file = path.string();
  if (!std::filesystem::exists(path)) return;
  if (std::filesystem::is_directory(path)) {
    const bool has_one = std::filesystem::exists(path / "model.toml");
    throw Error("is a folder", file,
                has_one ? "palpate-precompute " + shell_word((path / "model.toml").string())
                        : "Give the path of a model.toml");
  }
  check_is_read(path);
  const FileKind* const kind = kind_by_name(path);
  if (kind != nullptr && !kind->geometry.empty()) {
    throw Error(fmt::format("is {}, not a model.toml, which says what it is made of and held by", kind->what),
                file,
                "Write a model.toml beside it and give that to palpate-precompute, to begin with:\n" +
                    first_description(path, kind->geometry));
  }
  if (kind == nullptr &&
      read_all(path, "Give the path of a model.toml", largest_description).find("[geometry]") ==
          std::string::npos) {
    throw Error(
        "is neither a description (.toml, with a table [geometry]) nor of a kind that is known", file,
        "give a surface (.stl, .obj, .ply, .off), a labelled image (.nrrd, .nii, .inr), a picture (.png, "
        ".pbm) or a description (.toml); meshio and 3D Slicer make these of many others");
  }
}

}  // namespace palpate
