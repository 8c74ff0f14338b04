// What is known again as an output of ours, and where outputs may be written; both programs do more of it in
// programs_outputs_test.py.
#include "formats/outputs/output_paths.h"

#include <gtest/gtest.h>

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "formats/model_file.h"
#include "formats/recording.h"
#include "tests/support/files/formats_sample.h"
#include "tests/support/files/formats_tamper.h"

namespace palpate::test::output_paths_test {
namespace {

using Example = std::pair<OutputKind, std::string>;

/// How outputs of each kind of text begin, of today and of versions before they had a mark.
const std::vector<Example> examples = {
    {OutputKind::report, "{\n  \"generator\": \"palpate-runtime 0.1.0\",\n"},
    {OutputKind::report,
     "{\n  \"file\": \"a.hdf\",\n  \"model\": \"a\",\n  \"fast\": true,\n  \"tool\": {}\n"},
    {OutputKind::contacts, "x,y,z,nx,ny,nz,fx,fy,fz,gap,simplex,held\n"},
    {OutputKind::field, "node,x,y,z,u0x,u0y,u0z,ux,uy,uz\n"},
    {OutputKind::field, "node,x,y,z,u0x,u0y,u0z,ux,uy,uz,sxx,syy,szz,sxy,syz,szx,von_mises\n"},
    {OutputKind::grid, "<?xml version=\"1.0\"?>\n<!-- palpate 0.1.0 -->\n<VTKFile type=\"UnstructuredGrid\""},
    {OutputKind::grid,
     "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" "
     "byte_order=\"LittleEndian\" "
     "header_type=\"UInt64\">\n<UnstructuredGrid>\n<Piece NumberOfPoints=\"8\""},
    {OutputKind::frames, "<?xml version=\"1.0\"?>\n<!-- palpate 0.1.0 -->\n<!DOCTYPE Xdmf"},
    {OutputKind::frames,
     "<?xml version=\"1.0\"?>\n<!DOCTYPE Xdmf SYSTEM \"Xdmf.dtd\" [\n<!ENTITY t '<Topology TopologyType="},
    {OutputKind::page,
     "<!doctype html>\n<html>\n<head>\n<meta name=\"generator\" content=\"palpate-runtime 0.1.0\">"},
    {OutputKind::faces, "OFF\n6 2 0\n0 0 0\n"},
    {OutputKind::page, "<!doctype html>\n<html lang=\"en\">\n<head>\n<title>Palpate</title>\n"}};

constexpr OutputKind all_kinds[] = {OutputKind::model,  OutputKind::recording, OutputKind::frames,
                                    OutputKind::report, OutputKind::contacts,  OutputKind::field,
                                    OutputKind::grid,   OutputKind::page};

TEST(OutputKind, IsKnownByItsContent) {
  const Folder folder;
  for (const auto& [kind, text] : examples) {
    for (const bool cut : {false, true}) {
      write_bytes(folder / "out", cut ? text.substr(0, text.size() / 3) : text);
      EXPECT_EQ(is_ours(folder / "out", kind), !cut) << text;
    }
    write_bytes(folder / "out", text);
    for (const OutputKind other : all_kinds) {
      const bool both_xml = text.find("<!-- palpate") != std::string::npos &&
                            (other == OutputKind::grid || other == OutputKind::frames);
      if (other != kind && !both_xml) {
        EXPECT_FALSE(is_ours(folder / "out", other)) << text;
      }
    }
  }
}

TEST(OutputKind, WhatOthersWriteIsNotOurs) {
  const Folder folder;
  const char* const vtu =
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" "
      "byte_order=\"LittleEndian\" "
      "header_type=\"UInt64\">\n  <UnstructuredGrid>\n    <Piece NumberOfPoints=\"8\"";
  for (const std::string text :
       {"{\n  \"file\": \"a.hdf\"\n}\n", "x,y,z\n0,0,0\n", "node,x,y,z\n", "notes\n", "\n",
        "\x89HDF\r\n\x1a\n", "x,y,z,nx,ny,nz,fx,fy,fz,gap,simplex,held,remark\n",
        "time,device_x,device_y,device_z,mine\n", vtu, "<!doctype html>\n<title>Mine</title>",
        "OFF\n8 6 0\n"}) {
    write_bytes(folder / "out", text);
    for (const OutputKind kind : all_kinds) EXPECT_FALSE(is_ours(folder / "out", kind)) << text;
  }
  write_bytes(folder / "out", "");
  for (const OutputKind kind : all_kinds) EXPECT_TRUE(is_ours(folder / "out", kind)) << "it is empty";
}

TEST(OutputKind, HdfFilesSayWhatTheyAre) {
  const Folder folder;
  write_sample(folder / "a.hdf");
  RecordingWriter(folder / "a.mcap", {}).finish();
  EXPECT_TRUE(is_ours(folder / "a.hdf", OutputKind::model));
  EXPECT_TRUE(is_ours(folder / "a.mcap", OutputKind::recording));
  EXPECT_FALSE(is_ours(folder / "a.hdf", OutputKind::recording));
  EXPECT_FALSE(is_ours(folder / "a.mcap", OutputKind::model));
  RecordingWriter killed(folder / "killed.mcap", {});
  killed.checkpoint();
  EXPECT_TRUE(is_ours(folder / "killed.mcap", OutputKind::recording));
}

// It cannot be made again.
TEST(OutputPaths, ARecordingThatHoldsTicksIsNotReplaced) {
  const Folder folder;
  RecordingWriter(folder / "empty.mcap", {}).finish();
  RecordingWriter done(folder / "done.mcap", {}), killed(folder / "killed.mcap", {});
  done.append(TickRecord{});
  done.finish();
  killed.append(TickRecord{});
  killed.checkpoint();
  for (const char* name : {"empty.mcap", "done.mcap", "killed.mcap"}) {
    const auto add = [&](OutputPaths paths) {
      return refusal([&] { paths.add(folder / name, OutputKind::recording, "--record"); });
    };
    EXPECT_EQ(add(OutputPaths(false)).find("is a recording already") != std::string::npos,
              std::string(name) != "empty.mcap")
        << name;
    EXPECT_EQ(add(OutputPaths(true)), "") << name;
  }
}

TEST(OutputPaths, InputsMayComeLater) {
  const Folder folder;
  write_bytes(folder / "source", "");
  OutputPaths paths(true);
  paths.add(folder / "source", OutputKind::report, "--report");
  const std::string text =
      refusal([&] { paths.add_input(folder / "source", "what the model was made from"); });
  EXPECT_NE(text.find("what the model was made from"), std::string::npos) << text;
  paths.add_input(folder / "gone", "the script");  // nothing to lose
}

TEST(OutputPaths, ARelativeNameIsThatOfTheAbsoluteOne) {
  const Folder folder;
  const std::filesystem::path before = std::filesystem::current_path();
  std::filesystem::current_path(folder.path());
  OutputPaths paths(false);
  paths.add("new", OutputKind::report, "--report");  // neither is there
  EXPECT_NE(refusal([&] { paths.add(folder / "new", OutputKind::contacts, "--contacts"); }), "");
  std::filesystem::current_path(before);
}

TEST(OutputPaths, LeaveNothingBehind) {
  const Folder folder;
  OutputPaths paths(false);
  paths.add(folder / "a.hdf", OutputKind::model, "-o");
  paths.add(folder / "b.mcap", OutputKind::recording, "--record");
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

}  // namespace
}  // namespace palpate::test::output_paths_test
