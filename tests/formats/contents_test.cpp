// Files that others wrote: what reading them does to the program, and what they do to it.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <csignal>
#include <cstring>
#include <iterator>
#include <thread>

#include "base/error.h"
#include "base/file_io.h"
#include "base/program.h"
#include "formats/hdf5_contents.h"
#include "formats/model_file.h"
#include "formats/recording.h"
#include "matrices/hierarchical_product.h"
#include "tests/support/formats_sample.h"
#include "tests/support/formats_tamper.h"

namespace palpate::test::contents_test {
namespace {

/// Wait status of a child that runs `work`.
int status_of_child(const std::function<void()>& work) {
  const pid_t child = fork();
  if (child == 0) {
    std::signal(SIGBUS, SIG_DFL);  // also where a sanitizer has a handler
    work();
    _exit(0);
  }
  int status = -1;
  waitpid(child, &status, 0);
  return status;
}

/// A signal's action, put back when it goes.
class SignalAction {
 public:
  SignalAction(int signal, void (*handler)(int)) : signal_(signal) {
    struct sigaction action {};
    action.sa_handler = handler;
    sigaction(signal, &action, &before_);
  }
  ~SignalAction() { sigaction(signal_, &before_, nullptr); }
  SignalAction(const SignalAction&) = delete;
  SignalAction& operator=(const SignalAction&) = delete;

 private:
  int signal_;
  struct sigaction before_ {};
};

std::ptrdiff_t open_files() {
  return std::distance(std::filesystem::directory_iterator("/proc/self/fd"),
                       std::filesystem::directory_iterator());
}

TEST(Contents, FindsWhatWasWritten) {
  const Folder folder;
  const std::vector<double> values = {1, 2, 3, 4, 5, 6};
  {
    hdf5::File file = hdf5::File::create(folder / "a.h5");
    file.write("/group/values", hdf5::element_type<double>(), std::array<std::int64_t, 2>{3, 2},
               values.data());
    file.make_link("/link", "/group/values");
    file.write_attribute("/group/values", "text", std::string("of a dataset"));
    file.write_attribute("/", "numbers", std::array<std::int64_t, 3>{7, -8, 9});
    file.close();
  }
  const auto contents = hdf5::Contents::read(folder / "a.h5");
  EXPECT_TRUE(contents.has("/group"));
  EXPECT_FALSE(contents.has("/link")) << "a link is not the file's own";
  EXPECT_EQ(contents.text_attribute("/group/values", "text"), "of a dataset");
  EXPECT_EQ(contents.integer_attribute("/", "numbers", 3), (std::vector<std::int64_t>{7, -8, 9}));
  EXPECT_FALSE(contents.integer_attribute("/", "numbers", 2));
  EXPECT_FALSE(contents.text_attribute("/", "numbers"));
  std::vector<double> rows(4);
  contents.read_rows("/group/values", hdf5::element_type<double>(), 1, 2, rows.data());
  EXPECT_EQ(rows, (std::vector<double>{3, 4, 5, 6}));
  EXPECT_THROW(contents.read_rows("/group/values", hdf5::element_type<double>(), 2, 2, rows.data()), Error);
  EXPECT_THROW(static_cast<void>(contents.locate("/group/values", hdf5::element_type<float>(), 2)), Error);
}

TEST(Contents, OfAForeignFileHaveALimit) {
  const Folder folder;
  {
    hdf5::File file = hdf5::File::create(folder / "a.h5");
    for (int k = 0; k < 10'001; ++k) file.make_group(fmt::format("/{}", k));
    file.close();
  }
  const std::string text = refusal([&] { hdf5::Contents::read(folder / "a.h5"); });
  EXPECT_NE(text.find("more than 10000"), std::string::npos) << text;
}

TEST(Contents, AreReadInAHostThatCaresForItsChildrenItself) {
  const Folder folder;
  write_sample(folder / "a.palpate.hdf");
  const std::ptrdiff_t files = open_files();
  {
    const SignalAction ignored(SIGCHLD, SIG_IGN);  // children are reaped by the kernel
    EXPECT_NO_THROW(load_model(folder / "a.palpate.hdf"));
  }
  static std::atomic<int> ended;
  ended = 0;
  {
    const SignalAction handled(SIGCHLD, [](int) {
      while (waitpid(-1, nullptr, WNOHANG) > 0) ++ended;
    });
    EXPECT_NO_THROW(load_model(folder / "a.palpate.hdf"));
    struct sigaction now {};
    sigaction(SIGCHLD, nullptr, &now);
    EXPECT_NE(now.sa_handler, SIG_DFL);
  }
  const pid_t child = fork();
  if (child == 0) _exit(5);
  EXPECT_NO_THROW(load_model(folder / "a.palpate.hdf"));
  int status = 0;
  EXPECT_EQ(waitpid(child, &status, 0), child) << "the host's child is the host's";
  EXPECT_EQ(WEXITSTATUS(status), 5);
  EXPECT_EQ(open_files(), files);
}

TEST(Contents, AreReadInAHostWithThreadsAndTimers) {
  const Folder folder;
  write_sample(folder / "a.palpate.hdf");
  std::atomic<bool> stop = false;
  std::jthread beside([&] {
    while (!stop) std::vector<std::string>(100, "memory that is taken and given back");
  });
  const SignalAction handled(SIGALRM, [](int) {});
  const itimerval often = {{0, 2000}, {0, 2000}}, never = {};
  setitimer(ITIMER_REAL, &often, nullptr);
  for (int k = 0; k < 10; ++k) EXPECT_NO_THROW(load_model(folder / "a.palpate.hdf"));
  setitimer(ITIMER_REAL, &never, nullptr);
  stop = true;
}

// A mapped file that is cut off gives SIGBUS where it is read.
TEST(LoadedModel, DoesNotNeedItsFileAnyMore) {
  for (const bool is_swinging : {false, true}) {
    const Folder folder;
    const Model written = is_swinging
                              ? write_swinging_sample(folder / "a.palpate.hdf", DynamicsMethod::packed)
                              : write_sample(folder / "a.palpate.hdf");
    const int status = status_of_child([&] {
      const Model model = load_model(folder / "a.palpate.hdf");
      std::filesystem::resize_file(folder / "a.palpate.hdf", 0);
      for (std::int64_t i = 0; i < model.greens.order(); ++i)
        for (std::int64_t j = 0; j <= i; ++j)
          if (model.greens(i, j) != sample_entry(i, j)) _exit(1);
      if (is_swinging && !(model.dynamics.inverse(0, 0) > 0.0)) _exit(1);
    });
    EXPECT_TRUE(WIFEXITED(status)) << "signal " << WTERMSIG(status);
    EXPECT_EQ(WEXITSTATUS(status), 0);
  }
}

TEST(LoadedModel, IsMappedWhereItDoesNotFitIntoMemory) {
  const Folder folder;
  for (const Precision precision : {Precision::single_precision, Precision::double_precision}) {
    write_sample(folder / "a.palpate.hdf", precision);
    const Model read = load_model(folder / "a.palpate.hdf");
    const Model mapped = load_model(folder / "a.palpate.hdf", {.most_in_memory = 0});
    ASSERT_EQ(mapped.greens.order(), read.greens.order());
    const auto bytes =
        static_cast<std::size_t>(packed_size(read.greens.order()) * bytes_per_scalar(precision));
    EXPECT_EQ(std::memcmp(mapped.greens.data(), read.greens.data(), bytes), 0);
  }
}

/// What a program says and ends with when the file of a model is cut off that it has mapped.
void expect_a_plain_end(const std::filesystem::path& file, const std::function<double(const Model&)>& entry) {
  int ends[2] = {};
  ASSERT_EQ(pipe(ends), 0);
  const int status = status_of_child([&] {
    dup2(ends[1], STDERR_FILENO);
    end_with_an_error_on_shrunk_files();
    const Model model = load_model(file, {.most_in_memory = 0});
    std::filesystem::resize_file(file, 0);
    if (entry(model) != 0.0) _exit(77);
  });
  close(ends[1]);
  std::array<char, 1000> text = {};
  ASSERT_GT(read(ends[0], text.data(), text.size() - 1), 0);
  close(ends[0]);
  ASSERT_TRUE(WIFEXITED(status)) << "signal " << WTERMSIG(status);
  EXPECT_EQ(WEXITSTATUS(status), exit_input_error);
  EXPECT_EQ(std::string(text.data()),
            "error: " + file.string() +
                ": was cut off while it was in use, or its disk failed (bus error)\n"
                "hint: Leave files alone while a program reads them, and start it again\n");
}

TEST(LoadedModel, ThatIsMappedEndsAProgramPlainlyWhereItsFileIsCutOff) {
  const Folder folder;
  write_sample(folder / "a.palpate.hdf");
  expect_a_plain_end(folder / "a.palpate.hdf", [](const Model& model) { return model.greens(0, 0); });
  write_compressed_sample(folder / "b.palpate.hdf");
  expect_a_plain_end(folder / "b.palpate.hdf", [](const Model& model) {
    std::array<double, 9> block = {};
    const Index node = 0;
    gather_blocks(*model.compressed, node, {&node, 1}, block);
    return block[0];
  });
}

TEST(MappedFile, IsKnownByItsNameForAsLongAsItIsMapped) {
  const Folder folder;
  write_bytes(folder / "a\nb", std::string(10'000, 'x'));
  const FileDescriptor file = open_file(folder / "a\nb", OpenMode::read);
  const char* bytes = nullptr;
  for (int round = 0; round < 100; ++round) {
    const std::shared_ptr<const void> mapped = map_file(file, 100, 9'900);
    bytes = static_cast<const char*>(mapped.get());
    for (const char* at : {bytes, bytes + 9'899}) {
      ASSERT_NE(mapped_file_at(at), nullptr) << round;
      EXPECT_EQ(mapped_file_at(at), (folder.path() / "a\\nb").string());
    }
    EXPECT_EQ(mapped_file_at(bytes + 9'900 + 4096), nullptr);
  }
  EXPECT_EQ(mapped_file_at(bytes), nullptr);
  std::vector<std::shared_ptr<const void>> many;
  for (int k = 0; k < 100; ++k) many.push_back(map_file(file, 0, 10'000));
  EXPECT_NE(mapped_file_at(many.front().get()), nullptr);
  EXPECT_NO_THROW(many.clear());
}

TEST(Contents, OfWhatIsNoFileAreRefusedAtOnce) {
  const Folder folder;
  ASSERT_EQ(mkfifo((folder / "fifo").c_str(), 0600), 0);
  for (const std::filesystem::path& path :
       {folder / "fifo", folder.path(), std::filesystem::path("/dev/zero"), folder / "none"}) {
    EXPECT_NE(refusal([&] { load_model(path); }), "") << path;
    EXPECT_NE(refusal([&] { RecordingFile{path}; }), "") << path;
  }
}

}  // namespace
}  // namespace palpate::test::contents_test
