#include "precompute/description/not_a_description.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <string>
#include <string_view>

#include "base/error.h"
#include "base/printable.h"
#include "base/toml_text.h"

namespace palpate {
namespace {

/// How files of a kind end, and what [geometry] calls it.
struct Kind {
  std::string_view ending, key, what;
};

constexpr std::array<Kind, 16> geometry_endings = {{{".off", "surface", "a surface"},
                                                    {".obj", "surface", "a surface"},
                                                    {".stl", "surface", "a surface"},
                                                    {".ply", "surface", "a surface"},
                                                    {".inr", "image", "an image"},
                                                    {".inr.gz", "image", "an image"},
                                                    {".nii", "image", "an image"},
                                                    {".nii.gz", "image", "an image"},
                                                    {".nrrd", "image", "an image"},
                                                    {".msh", "volume", "a volume mesh"},
                                                    {".mesh", "volume", "a volume mesh"},
                                                    {".node", "volume", "a volume mesh"},
                                                    {".ele", "volume", "a volume mesh"},
                                                    {".vtk", "volume", "a volume mesh"},
                                                    {".png", "picture", "a picture"},
                                                    {".pbm", "picture", "a picture"}}};

std::string first_description(const std::filesystem::path& file, const Kind& kind) {
  const std::string name = file.filename().string();
  const bool plane = kind.key == "picture";
  std::string text = "    name = " + toml_string(name.substr(0, name.size() - kind.ending.size())) + "\n";
  if (plane) text += "    plane = \"stress\"\n    thickness = 0.001    # metres\n";
  text += "    [geometry]\n    " + std::string(kind.key) + " = " + toml_string(name) + "\n";
  text += plane ? "    scale = 0.001    # metres a pixel\n"
                : "    scale = 0.001    # metres per unit of the file: 0.001 for millimetres, 1 for metres\n";
  if (plane || kind.key == "image")
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
  std::string name = path.filename().string();
  std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::tolower(c); });
  for (const Kind& kind : geometry_endings) {
    if (!name.ends_with(kind.ending)) continue;
    throw Error(
        "is " + std::string(kind.what) + ", not a model.toml, which says what it is made of and held by",
        file,
        "Write a model.toml beside it and give that to palpate-precompute, to begin with:\n" +
            first_description(path, kind));
  }
  if (name.ends_with(".hdf"))
    throw Error("is a baked model already", file,
                "palpate-runtime play " + shell_word(file) + " --view shows it, palpate-precompute inspect " +
                    shell_word(file) + " says what is in it");
  if (name.ends_with(".mcap"))
    throw Error("is a recording", file, "palpate-runtime view " + shell_word(file) + " shows it");
}

}  // namespace palpate
