#include "formats/file_kinds.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <fstream>

#include "base/error.h"
#include "base/printable.h"
#include "formats/contents.h"

namespace palpate {
namespace {

// Commands that convert other formats into one that is read. Each is a line for a shell.
constexpr std::string_view meshio = "convert it: meshio convert --ascii FILE NAME.vtk";
constexpr std::string_view assimp = "convert it: assimp export FILE NAME.stl";
constexpr std::string_view gmsh = "convert it: gmsh -2 FILE -o NAME.stl";
constexpr std::string_view simple_itk =
    "convert it: python3 -c 'import sys, SimpleITK as s; s.WriteImage(s.ReadImage(sys.argv[1]), "
    "sys.argv[2])' FILE "
    "NAME.nrrd";
constexpr std::string_view nibabel =
    "convert it: python3 -c 'import sys, nibabel as n; i = n.load(sys.argv[1]); "
    "n.save(n.Nifti1Image(i.dataobj, "
    "i.affine), "
    "sys.argv[2])' FILE NAME.nii.gz";
constexpr std::string_view pyvista_surface =
    "convert it: python3 -c 'import sys, pyvista as p; "
    "p.read(sys.argv[1]).extract_surface().triangulate().save(sys.argv[2])' "
    "FILE NAME.stl";
constexpr std::string_view magick = "convert it: convert FILE NAME.png";
constexpr std::string_view blender = "open it in Blender and export the body as .stl";
constexpr std::string_view slicer = "open it in 3D Slicer and save the segmentation as NAME.nrrd";

constexpr auto all_kinds = std::to_array<FileKind>({
    {"a surface in OFF", ".off ", "surface", ""},
    {"a surface in OBJ", ".obj ", "surface", ""},
    {"a surface in STL", ".stl ", "surface", ""},
    {"a surface in PLY", ".ply ", "surface", ""},
    {"an INR image", ".inr .inr.gz ", "image", ""},
    {"a NIfTI image", ".nii .nii.gz ", "image", ""},
    {"an NRRD image", ".nrrd ", "image", ""},
    {"a volume mesh of Gmsh", ".msh ", "volume", ""},
    {"a volume mesh of Medit", ".mesh ", "volume", ""},
    {"a volume mesh of TetGen", ".node .ele ", "volume", ""},
    {"a volume mesh of VTK", ".vtk ", "volume", ""},
    {"a picture", ".png ", "picture", ""},
    {"a picture", ".pbm ", "picture", ""},
    {"a description", ".toml ", "", ""},
    {"a baked model already", ".hdf ", "",
     "to see it: palpate-runtime play FILE --view; what is in it: palpate-precompute inspect FILE"},
    {"a recording", ".mcap ", "", "to see it: palpate-runtime view FILE"},
    {"a file of HDF5 or MATLAB", ".h5 .hdf5 .mat .med ", "",
     "baked models end in .palpate.hdf; a mesh (.med): meshio convert --ascii FILE NAME.vtk"},
    {"a MetaImage", ".mha .mhd ", "", simple_itk},
    {"an NRRD image whose voxels are in another file", ".nhdr ", "",
     "convert it: unu save -f nrrd -i FILE -o NAME.nrrd"},
    {"an image in two files, of NIfTI or Analyze", ".hdr .img .hdr.gz .img.gz ", "", nibabel},
    {"an image of FreeSurfer", ".mgz .mgh ", "", "convert it: mri_convert FILE NAME.nii.gz"},
    {"a MINC image", ".mnc ", "", "convert it: mnc2nii FILE NAME.nii"},
    {"a slice or series in DICOM", ".dcm .ima .dicom ", "",
     "make a NIfTI image of the series with dcm2niix FOLDER, then segment the organ, in 3D Slicer for "
     "instance"},
    {"a volume mesh of VTK in XML", ".vtu .pvtu ", "", meshio},
    {"a surface of VTK in XML", ".vtp .pvtp ", "", pyvista_surface},
    {"an image of VTK in XML", ".vti .pvti ", "", slicer},
    {"a grid or collection of VTK in XML", ".pvd .vts .vtr .vtm .pvts ", "",
     "open it in ParaView and save one mesh as .vtk (legacy, ASCII)"},
    {"a mesh of Abaqus", ".inp ", "", meshio},
    {"a mesh of Nastran", ".bdf .nas .fem ", "", meshio},
    {"a mesh in Exodus or netCDF", ".exo .e .ex2 .nc ", "", meshio},
    {"a mesh in XDMF", ".xdmf .xmf ", "", meshio},
    {"a volume mesh", ".su2 .mdpa .ugrid .avs .f3grid .h5m ", "", meshio},
    {"a volume mesh", ".unv .cgns .cdb .neu .mphtxt .k ", "",
     "write it as .msh, which Gmsh does for .unv and .cgns: gmsh -save -format msh41 FILE -o NAME.msh"},
    {"a scene in glTF", ".glb .gltf ", "", assimp},
    {"a body in 3MF", ".3mf .amf ", "", assimp},
    {"a body of CAD in STEP", ".step .stp .p21 ", "", gmsh},
    {"a body of CAD in IGES", ".iges .igs ", "", gmsh},
    {"a body of CAD", ".brep .sldprt .fcstd .ipt .sat .x_t .3dm .dxf .dwg .scad ", "",
     "export it from the CAD program as .stl, or as .step and then: gmsh -2 NAME.step -o NAME.stl"},
    {"a scene in FBX", ".fbx ", "", assimp},
    {"a scene in COLLADA", ".dae ", "", assimp},
    {"a scene in VRML or X3D", ".wrl .vrml .x3d .3ds ", "", assimp},
    {"a file of Blender", ".blend ", "", blender},
    {"a scene in USD", ".usd .usda .usdc .usdz ", "", blender},
    {"a picture in JPEG", ".jpg .jpeg .jfif ", "", magick},
    {"a picture in TIFF", ".tif .tiff ", "",
     "a picture: convert FILE NAME.png; a stack of slices: 3D Slicer, saved as NAME.nrrd"},
    {"a picture", ".gif .bmp .webp .heic .avif .tga ", "", magick},
    {"a picture in grey or colours", ".pgm .ppm .pnm ", "", magick},
    {"a drawing in SVG", ".svg ", "", "convert it: inkscape FILE -o NAME.png"},
    {"a document", ".pdf .docx .odt ", "", "give the picture, surface, image or mesh of the body"},
    {"an archive", ".zip .tar .tgz .7z .rar .mrb .gz .bz2 .xz .zst ", "", "unpack it and give what is in it"},
    {"a table", ".csv .tsv .xlsx .ods ", "",
     "a table of poses moves a tool: palpate-runtime play MODEL.palpate.hdf --device script:FILE"},
});

std::string lower(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

/// Longest of the kind's endings that a name in small letters has; empty if none.
std::string_view ending_of(const FileKind& kind, const std::string& name) {
  std::string_view longest, rest = kind.endings;
  while (!rest.empty()) {
    const std::string_view ending = rest.substr(0, rest.find(' '));
    rest.remove_prefix(ending.size() + 1);
    if (name.ends_with(ending) && ending.size() > longest.size()) longest = ending;
  }
  return longest;
}

struct Named {
  const FileKind* kind = nullptr;
  std::string_view ending;
};

Named named(const std::filesystem::path& file) {
  const std::string name = lower(file.filename().string());
  Named found;
  for (const FileKind& kind : all_kinds)
    if (const std::string_view ending = ending_of(kind, name); ending.size() > found.ending.size())
      found = {&kind, ending};
  return found;
}

/// Bytes at a fixed place in files of the kind with this ending.
struct Magic {
  std::string_view ending;
  std::size_t at;
  std::string_view bytes;
};

using namespace std::string_view_literals;

constexpr std::array magics = {
    Magic{".png", 0, "\x89PNG\r\n\x1a\n"},
    Magic{".h5", 0, "\x89HDF\r\n\x1a\n"},
    Magic{".h5", 0, index_magic},
    Magic{".mcap", 0, "\x89MCAP0\r\n"},
    Magic{".jpg", 0, "\xff\xd8\xff"},
    Magic{".tif", 0, "II*\0"sv},
    Magic{".tif", 0, "MM\0*"sv},
    Magic{".gif", 0, "GIF8"},
    Magic{".gif", 8, "WEBP"},
    Magic{".pdf", 0, "%PDF-"},
    Magic{".inr", 0, "#INRIMAGE-4#{"},
    Magic{".nii", 344, "n+1\0"sv},
    Magic{".nii", 4, "n+2\0"sv},
    Magic{".hdr", 344, "ni1\0"sv},
    Magic{".hdr", 4, "ni2\0"sv},
    Magic{".dcm", 128, "DICM"},
    Magic{".mnc", 0, "CDF\x01"},
    Magic{".glb", 0, "glTF"},
    Magic{".fbx", 0, "Kaydara FBX"},
    Magic{".blend", 0, "BLENDER"},
    Magic{".usd", 0, "PXR-USDC"},
    Magic{".usd", 0, "#usda"},
    Magic{".step", 0, "ISO-10303-21"},
    Magic{".wrl", 0, "#VRML"},
    Magic{".msh", 0, "$MeshFormat"},
    Magic{".mesh", 0, "MeshVersionFormatted"},
    Magic{".vtk", 0, "# vtk DataFile"},
    Magic{".ply", 0, "ply\n"},
    Magic{".ply", 0, "ply\r\n"},
    Magic{".off", 0, "OFF\n"},
    Magic{".off", 0, "OFF\r\n"},
    Magic{".off", 0, "OFF "},
};

/// Words somewhere in the first bytes of text files.
constexpr std::array marks_in_text = {Magic{".vtu", 0, "type=\"UnstructuredGrid\""},
                                      Magic{".vtu", 0, "type=\"PUnstructuredGrid\""},
                                      Magic{".vtp", 0, "type=\"PolyData\""},
                                      Magic{".vtp", 0, "type=\"PPolyData\""},
                                      Magic{".vti", 0, "type=\"ImageData\""},
                                      Magic{".vti", 0, "type=\"PImageData\""},
                                      Magic{".pvd", 0, "<VTKFile"},
                                      Magic{".xdmf", 0, "<Xdmf"},
                                      Magic{".svg", 0, "<svg"},
                                      Magic{".dae", 0, "<COLLADA"},
                                      Magic{".wrl", 0, "<X3D"}};

bool begins_with_word(std::string_view text, std::string_view first) {
  return text.starts_with(first) && text.size() > first.size() &&
         std::isspace(static_cast<unsigned char>(text[first.size()])) != 0;
}

/// True for STL, which has no magic number: a text that begins like one, or the size that its number of
/// triangles implies.
bool is_stl(std::string_view head, std::uintmax_t bytes) {
  if (head.starts_with("solid") && head.find("facet") != std::string_view::npos) return true;
  if (head.size() < 84) return false;
  std::uint32_t count = 0;
  for (std::size_t i = 4; i-- > 0;) count = count << 8 | static_cast<unsigned char>(head[80 + i]);
  return count > 0 && bytes == 84 + 50 * static_cast<std::uintmax_t>(count);
}

std::string filled_in(std::string_view command, const std::filesystem::path& file) {
  std::string text;
  const std::string given = shell_word(file.string()), name = name_without_ending(file);
  while (!command.empty()) {
    const bool is_file = command.starts_with("FILE"),
               is_name = command.starts_with("NAME") && command.substr(4).starts_with('.');
    if (is_name) {
      const std::size_t end = std::min(command.find_first_of(" ,;"), command.size());
      text += shell_word(name + std::string(command.substr(4, end - 4)));
      command.remove_prefix(end);
    } else if (is_file) {
      text += given;
      command.remove_prefix(4);
    } else {
      text += command.front();
      command.remove_prefix(1);
    }
  }
  return text;
}

}  // namespace

const FileKind* kind_by_name(const std::filesystem::path& file) {
  return named(file).kind;
}

std::string name_without_ending(const std::filesystem::path& file) {
  const std::string name = file.filename().string();
  const Named found = named(file);
  return found.kind == nullptr ? file.stem().string() : name.substr(0, name.size() - found.ending.size());
}

const FileKind* kind_by_content(const std::filesystem::path& file) {
  std::error_code problem;
  if (!std::filesystem::is_regular_file(file, problem)) return nullptr;
  std::string head(4096, '\0');
  std::ifstream stream(file, std::ios::binary);
  stream.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(std::max<std::streamsize>(stream.gcount(), 0)));
  const std::string_view text = head;
  if (text.starts_with("NRRD000")) {
    const std::string small = lower(head.substr(0, head.find("\n\n")));
    const bool is_apart =
        small.find("\ndata file:") != std::string::npos || small.find("\ndatafile:") != std::string::npos;
    return kind_by_name(is_apart ? ".nhdr" : ".nrrd");
  }
  for (const Magic& magic : magics)
    if (text.size() > magic.at && text.substr(magic.at).starts_with(magic.bytes))
      return kind_by_name(magic.ending);
  if (begins_with_word(text, "P1") || begins_with_word(text, "P4")) return kind_by_name(".pbm");
  for (const std::string_view first : {"P2", "P3", "P5", "P6"})
    if (begins_with_word(text, first)) return kind_by_name(".pgm");
  if (text.starts_with("ObjectType") || text.starts_with("NDims")) return kind_by_name(".mha");
  if (text.starts_with('<'))
    for (const Magic& mark : marks_in_text)
      if (text.find(mark.bytes) != std::string_view::npos) return kind_by_name(mark.ending);
  if (is_stl(text, std::filesystem::file_size(file, problem))) return kind_by_name(".stl");
  return nullptr;
}

void check_is_read(const std::filesystem::path& file, std::string_view geometry) {
  std::error_code problem;
  if (!std::filesystem::is_regular_file(file, problem)) return;
  const auto [by_name, ending] = named(file);
  const FileKind* const by_content = kind_by_content(file);
  // A container alone does not determine its contents.
  const bool is_container =
      by_content == kind_by_name(".h5") && by_name != nullptr && by_name->geometry.empty();
  const FileKind* const kind = by_content != nullptr && !is_container ? by_content : by_name;
  if (kind == nullptr || kind == kind_by_name(".toml")) return;
  const std::string where = file.string();
  if (kind->geometry.empty()) {
    throw Error(
        fmt::format(
            "is {}{}{}", kind->what, kind == by_name ? "" : " by its contents",
            kind == kind_by_name(".hdf") || kind == kind_by_name(".mcap") ? "" : ", which is not read"),
        where, filled_in(kind->command, file));
  }
  if (!geometry.empty() && geometry != kind->geometry)
    throw Error(fmt::format("is {}, and {} = in [geometry] does not read that", kind->what, geometry), where,
                fmt::format("write {} = under [geometry]", kind->geometry));
  if (by_name == kind) return;
  const std::string_view usual = kind->endings.substr(0, kind->endings.find(' '));
  throw Error(
      fmt::format("is {} by its contents, and its name does not end in {}", kind->what, usual), where,
      fmt::format(
          "rename it: mv {} {}", shell_word(where),
          shell_word((file.parent_path() / (name_without_ending(file) + std::string(usual))).string())));
}

}  // namespace palpate
