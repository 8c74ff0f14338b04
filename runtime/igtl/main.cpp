// palpate-openigtlink: lets OpenIGTLink clients watch a run.
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <optional>
#include <string>

#include "base/command_line.h"
#include "base/error.h"
#include "base/program.h"
#include "runtime/igtl/igtl_server.h"
#include "runtime/igtl/watch.h"

namespace {

using namespace palpate;

constexpr int niceness = 5;  // the run comes first

void send(const std::string& page, const ListenAddress& listen) {
  setpriority(PRIO_PROCESS, 0, niceness);
  boost::asio::io_context context{1};
  ListeningSocket socket(listen, "--listen");
  std::optional<IgtlServer> server;
  watch(
      context, page, [&](const WatchedPicture& picture) { server->show(picture); },
      [&] { server->finish(); });
  say(stderr, "OpenIGTLink clients find the run at {}, port {}\n", socket.address().address,
      socket.address().port);
  server.emplace(context, std::move(socket));
  context.run();
}

int run(int argc, char** argv) {
  CLI::App app("Sends a run that palpate-runtime shows to 3D Slicer and other OpenIGTLink clients.",
               "palpate-openigtlink");
  app.formatter(std::make_shared<HelpFormatter>());
  app.set_version_flag("--version", "palpate-openigtlink " PALPATE_VERSION);
  std::string page, listen = "18944";
  app.add_option("PAGE", page, "address of the run's page, as palpate-runtime play --view or view prints it")
      ->required()
      ->type_name("");
  app.add_option("--listen", listen,
                 "where clients find it; default: 127.0.0.1:18944, the port at which they look; port 0: any "
                 "free one")
      ->type_name("[ADDRESS:]PORT");
  app.footer(
      "Surface, tool and force are sent until the run ends. Clients only watch.\n"
      "Examples:\n"
      "  palpate-openigtlink 'http://127.0.0.1:8017/?token=...'\n"
      "Exit status: 0 the run has ended, 1 no such run, 2 wrong arguments.");
  if (asks_for_json(argc, argv)) return print_help_json(app, nlohmann::ordered_json::object());
  try {
    parse(app, argc, argv);
    const std::optional<ListenAddress> place = parse_listen_address(listen);
    if (!place) throw CLI::ValidationError("--listen", "'" + listen + "' is not [ADDRESS:]PORT");
    send(page, *place);
    return exit_ok;
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    return tell_usage(error.what(), meant_option(app, argc, argv) + "See palpate-openigtlink --help");
  }
}

}  // namespace

int main(int argc, char** argv) {
  return palpate::run_program("palpate-openigtlink", "close other programs", [&] { return run(argc, argv); });
}
