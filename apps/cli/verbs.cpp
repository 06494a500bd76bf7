// SPDX-License-Identifier: Apache-2.0
#include <array>

#include "apps/cli/verb.h"

namespace forest::cli {

// One declaration and one row a verb, in the order of --help.
std::function<void()> demo(CLI::App&, Console&);
std::function<void()> import_files(CLI::App&, Console&);
std::function<void()> fetch_cells(CLI::App&, Console&);
std::function<void()> list(CLI::App&, Console&);
std::function<void()> show(CLI::App&, Console&);
std::function<void()> query(CLI::App&, Console&);
std::function<void()> export_files(CLI::App&, Console&);
std::function<void()> remove_neurons(CLI::App&, Console&);
std::function<void()> convert(CLI::App&, Console&);
std::function<void()> check(CLI::App&, Console&);
std::function<void()> measure(CLI::App&, Console&);
std::function<void()> distributions(CLI::App&, Console&);
std::function<void()> compare(CLI::App&, Console&);
std::function<void()> typical(CLI::App&, Console&);
std::function<void()> classify(CLI::App&, Console&);
std::function<void()> judge(CLI::App&, Console&);
std::function<void()> cortex(CLI::App&, Console&);
std::function<void()> model(CLI::App&, Console&);
std::function<void()> fit(CLI::App&, Console&);
std::function<void()> grow(CLI::App&, Console&);
std::function<void()> plant(CLI::App&, Console&);
std::function<void()> bench(CLI::App&, Console&);
std::function<void()> pack(CLI::App&, Console&);
std::function<void()> render(CLI::App&, Console&);
std::function<void()> activity(CLI::App&, Console&);
std::function<void()> clamp(CLI::App&, Console&);
std::function<void()> raster(CLI::App&, Console&);
std::function<void()> movie(CLI::App&, Console&);
std::function<void()> targets(CLI::App&, Console&);
std::function<void()> section(CLI::App&, Console&);
std::function<void()> view(CLI::App&, Console&);

std::span<const Verb> verbs() {
  static constexpr auto table = std::to_array<Verb>({
      {"demo", "Do it all: grow, store, plant, pack, draw and film a forest", "brainforest demo --out demo",
       demo},
      {"import", "Store traced neurons in a repository",
       "brainforest import cells/ more/cell7.swc --repo cells.db --population traced\n"
       "  brainforest import edited.xlsx --repo cells.db",
       import_files},
      {"fetch", "Download cells from NeuroMorpho.Org or a service like it",
       "brainforest fetch cnic_001 NMO_00002 --out cells/\n"
       "  brainforest fetch --query \"species:rat AND brain_region:neocortex\" --limit 20 --repo cells.db",
       fetch_cells},
      {"list", "List the populations and neurons of a repository",
       "brainforest list --repo cells.db --where \"type = 'L5 pyramidal' and total_length > 5000\"", list},
      {"show", "Show all that is known of a neuron: soma, arbors, sections, where it comes from",
       "brainforest show cell7 --repo cells.db", show},
      {"query", "Ask a repository a question in SQL",
       "brainforest query \"select kind, count(*), sum(length) from section group by kind\" --repo cells.db",
       query},
      {"export", "Write neurons of a repository as files",
       "brainforest export --repo cells.db --population traced --format swc --out exported/", export_files},
      {"remove", "Take neurons out of a repository",
       "brainforest remove cell7 --repo cells.db --population traced", remove_neurons},
      {"convert", "Turn neuron files of one format into another",
       "brainforest convert cell7.swc cell7.asc\n"
       "  brainforest convert cells/ --format swc --out as_swc/",
       convert},
      {"check", "Say what is odd in neuron files, and mend them", "brainforest check cells/ --repair mended/",
       check},
      {"measure", "Measure neurons: lengths, counts, angles, asymmetry, Sholl and more",
       "brainforest measure cells/*.swc --kind dendrite --csv cells.csv\n"
       "  brainforest measure --repo cells.db --population L5 --by type --xlsx types.xlsx",
       measure},
      {"distributions",
       "Fit what the branches of a population are drawn from: chances to fork, lengths, angles, diameters",
       "brainforest distributions cells/ --kind basal --by order\n"
       "  brainforest distributions --repo cells.db --population L5 --keep",
       distributions},
      {"compare", "Say whether two populations can be told apart, by what, and how surely",
       "brainforest compare pyramidal/ basket/ --kind dendrite --report apart.html\n"
       "  brainforest compare --repo cells.db --population traced --with grown",
       compare},
      {"typical", "Say how typical neurons are of a population, and what makes them abnormal",
       "brainforest typical cell7.swc --population cells/\n"
       "  brainforest typical cell7 --repo cells.db --population L5",
       typical},
      {"classify", "Find types of neurons, how many there are, and what defines them",
       "brainforest classify cells/ --csv types.csv --report types.html", classify},
      {"judge",
       "Judge whether grown neurons are indistinguishable from traced ones, which the model never saw",
       "brainforest judge --model like_them.lsys --train fitted/ --held-out others/ --report judged.html\n"
       "  brainforest judge --grown grown/ --train fitted/ --held-out others/ --features features.csv\n"
       "  brainforest judge --leave-one-out --train few/",
       judge},
      {"cortex",
       "Build the tissue: finite elements between two surfaces, grids within them, and how good they are",
       "brainforest cortex build lh.pial lh.white -o elements.h5\n"
       "  brainforest cortex report elements.h5",
       cortex},
      {"model", "Keep what neurons grow from: list, show, edit, import, export and compare models",
       "brainforest model import pyramidal --repo cells.db\n"
       "  brainforest model edit pyramidal --repo cells.db\n"
       "  brainforest model diff pyramidal --repo cells.db",
       model},
      {"fit", "Fit a model to traced neurons, which grows more of them",
       "brainforest fit cells/ -o like_them.lsys\n"
       "  brainforest fit --repo cells.db --population traced --model like_traced",
       fit},
      {"grow", "Grow neurons from a grammar",
       "brainforest grow --grammar pyramidal --count 100 --seed 1 --repo forest.db\n"
       "  brainforest grow --grammar pyramidal --count 1000000 --seed 1 --out grown.cells",
       grow},
      {"plant", "Plant neurons of a repository in a column or in elements of a cortex, as a SONATA circuit",
       "brainforest plant --recipe column-1000 --repo cells.db --seed 7 --out column/", plant},
      {"pack", "Pack a circuit for drawing, as a forest file", "brainforest pack column/ -o column.forest",
       pack},
      {"activity", "Pack a simulation's report for playing, as an activity file",
       "brainforest activity compartments.h5 --circuit column/ --spikes spikes.h5 --out run.activity",
       activity},
      {"clamp", "Show the history of compartments: the virtual clamp",
       "brainforest clamp run.activity --neuron 3 --section soma 12 --csv traces.csv", clamp},
      {"raster", "Draw the somata of all neurons over time as a picture",
       "brainforest raster run.activity --out raster.png", raster},
      {"targets", "List the sets of neurons that a forest has, and define others",
       "brainforest targets column.forest\n"
       "  brainforest targets column.forest --define \"deep=(L5 or L6) and not inhibitory\" --out sets.json",
       targets},
      {"render", "Draw a forest as a picture, without a display",
       "brainforest render column.forest --view view.json --size 1920x1080 -o column.png\n"
       "  brainforest render cell7.swc --legend --scale -o cell7.png\n"
       "  brainforest render column.forest --activity run.activity --time 12.5 -o moment.png\n"
       "  brainforest render lh.pial --overlay lh.thickness --range 1.5:3.5 -o cortex.png",
       render},
      {"movie", "Film a walk through a forest, without a display",
       "brainforest movie column.forest --seconds 5 -o walk.mp4\n"
       "  brainforest movie column.forest --activity run.activity --rate 4 -o playing.mp4",
       movie},
      {"section", "Cut a forest by a plane, as a section of a series shows it: picture, contours or areas",
       "brainforest section column.forest --plane 0,1000,0,0,0,1 --height 100 -o section.png\n"
       "  brainforest section column.forest --plane 0,1000,0,1,1,0 -o areas.csv",
       section},
      {"view", "Open a forest in the studio", "brainforest view column.forest", view},
      {"bench", "Measure speed and memory", "brainforest bench io --json", bench},
  });
  return table;
}

}  // namespace forest::cli
