// SPDX-License-Identifier: Apache-2.0
// The tables of a repository, as steps from version to version; docs/repository/schema.md draws them. Plain SQL but for
// words in @, for which each database has its own: @id and @long_id (a whole number of 32 or 64 bits that names a row), @bytes,
// @by_key (rows kept in the order of their key), and
// @on_a_server before a statement that a file does not need.
#pragma once

#include <array>

namespace forest::repository {

inline constexpr int application_id =
    0x42466f72;  // "BFor": how `file` and we tell a repository from other SQLite files

struct Migration {
  int to;  // the version these statements lead to
  const char* sql;
};

inline constexpr std::array migrations{
    Migration{1, R"sql(
create table populations (
  id   @id,
  name text not null unique
);
create table grammars (
  id   @id,
  name text not null,
  hash text not null,
  text text not null,
  unique (hash, name)
);
create table neurons (
  id          @id,
  population  integer not null references populations (id),
  name        text    not null,
  fingerprint text    not null,           -- the same source has the same one
  species     text    not null,           -- '' when not known, as the next three
  region      text    not null,
  layer       text    not null,
  type        text    not null,
  stems       integer not null,
  sections    integer not null,
  points      integer not null,
  spines      integer not null,
  length      double precision not null,  -- micrometres
  checksum    bigint  not null,           -- of everything morphology() returns
  unique (population, name),
  unique (population, fingerprint)
);
create table provenance (
  neuron      integer primary key references neurons (id) on delete cascade,
  origin      text not null check (origin in ('traced', 'grown')),
  source_file text,                       -- traced
  source_hash text,
  grammar     integer references grammars (id),  -- grown
  seed        bigint,
  number      bigint,
  program     text not null
);
create index provenance_by_grammar on provenance (grammar);
create table somata (
  neuron integer primary key references neurons (id) on delete cascade,
  kind   text not null,
  x      double precision not null,       -- a sphere of the same place and mean size, micrometres
  y      double precision not null,
  z      double precision not null,
  radius double precision not null,
  area   double precision not null,       -- square micrometres
  points @bytes,                            -- x, y, z, radius: float32, little-endian; null when there are none
  links  @bytes                             -- cylinders: parent of each point; contours: first point of each; int32
);
create table section_kinds (
  id   @id,               -- numbers of SWC
  name text not null unique
);
create table arbors (
  neuron    integer not null references neurons (id) on delete cascade,
  number    integer not null,
  root      integer not null,             -- section
  kind      integer not null,             -- as section_kinds.id
  sections  integer not null,
  terminals integer not null,
  max_order integer not null,
  length    double precision not null,    -- micrometres
  primary key (neuron, number)
) @by_key;
create table sections (
  neuron      integer not null references neurons (id) on delete cascade,
  number      integer not null,           -- parents before children, from 0
  parent      integer,                    -- null for a root
  arbor       integer not null,
  branch_order integer not null,          -- 0 for a stem, one more at every branch point
  length      double precision not null,  -- micrometres
  kind        integer not null,           -- as section_kinds.id
  tag         integer not null,           -- the number the file gave
  soma_point  integer not null,           -- a root: index of the soma point it leaves from, -1 when not known
  first_point integer not null,           -- into points.data
  point_count integer not null,
  primary key (neuron, number)
) @by_key;
create table points (
  neuron integer primary key references neurons (id) on delete cascade,
  data   @bytes not null                    -- x, y, z, radius of every point of every section: float32, little-endian
);
create table spines (
  neuron        integer not null references neurons (id) on delete cascade,
  number        integer not null,
  section       integer not null,
  position      double precision not null,  -- path distance from the start of the section, micrometres
  head_x        double precision not null,  -- of the head relative to the axis of the section
  head_y        double precision not null,
  head_z        double precision not null,
  head_diameter double precision not null,
  neck_diameter double precision not null,
  shape         integer not null,         -- 0 unknown, 1 stubby, 2 thin, 3 mushroom, 4 filopodium, 5 branched
  primary key (neuron, number)
) @by_key;
create table annotations (
  neuron integer not null references neurons (id) on delete cascade,
  number integer not null,                -- order in the file
  name   text not null,                   -- bytes that are no text are written \xHH, a backslash \\
  value  text not null,
  primary key (neuron, number)
) @by_key;
)sql"},
    // Points may be packed; sections tell their ends; metrics, distributions, and views for people.
    Migration{2, R"sql(
alter table points add column packing integer not null default 0;
alter table sections add column daughters integer not null default 0;
alter table sections add column area double precision not null default 0;
alter table sections add column start_diameter double precision not null default 0;
alter table sections add column end_diameter double precision not null default 0;
alter table sections add column end_x double precision not null default 0;
alter table sections add column end_y double precision not null default 0;
alter table sections add column end_z double precision not null default 0;
create table metrics (
  id         integer primary key,
  name       text not null unique,
  level      text not null,           -- neuron, arbor, section, bifurcation, point …; of all but the first the mean is kept
  unit       text not null,
  definition text not null
);
create table neuron_metrics (
  metric integer not null references metrics (id),
  neuron integer not null references neurons (id) on delete cascade,
  value  double precision not null,   -- no row where the metric is not defined
  primary key (metric, value, neuron)
) @by_key;
create unique index metrics_of_neuron on neuron_metrics (neuron, metric);
create table distributions (
  id         @id,
  population integer references populations (id),
  name       text    not null,
  version    integer not null,        -- counted from 1; an earlier one is never changed
  text       text    not null,
  unique (population, name, version)
);
create view neuron as
  select n.id, n.name, p.name as population, n.species, n.region, n.layer, n.type, n.stems, n.sections, n.points,
         n.spines, n.length, s.kind as soma, s.x as soma_x, s.y as soma_y, s.z as soma_z, s.radius as soma_radius,
         s.area as soma_area, o.origin, o.source_file, o.source_hash, g.name as grammar, o.seed, o.number, o.program
  from neurons n join populations p on p.id = n.population left join somata s on s.neuron = n.id
       left join provenance o on o.neuron = n.id left join grammars g on g.id = o.grammar;
create view section as
  select n.id as neuron, n.name as name, p.name as population, s.number as section, s.parent, s.arbor, s.branch_order,
         k.name as kind, s.tag, s.point_count as points, s.length, s.area, s.start_diameter, s.end_diameter
  from sections s join neurons n on n.id = s.neuron join populations p on p.id = n.population
       left join section_kinds k on k.id = s.kind;
create view junction as
  select n.id as neuron, n.name as name, p.name as population, s.number as section,
         case s.daughters when 0 then 'terminal' when 1 then 'node' when 2 then 'bifurcation' else 'multifurcation' end
           as junction,
         s.daughters, s.branch_order, s.end_x as x, s.end_y as y, s.end_z as z, s.end_diameter as diameter
  from sections s join neurons n on n.id = s.neuron join populations p on p.id = n.population;
create view metric as
  select n.id as neuron, n.name as name, p.name as population, m.name as metric, v.value, m.unit
  from neuron_metrics v join metrics m on m.id = v.metric join neurons n on n.id = v.neuron
       join populations p on p.id = n.population;
)sql"},
    // A section is named by one number, so that the table needs no index besides its own order. What version 2 kept is
    // moved by the program, which then drops old_sections.
    Migration{3, R"sql(
drop view section;
drop view junction;
alter table sections rename to old_sections;
create table sections (
  id           @long_id,                  -- 2^24 neuron + section; parents before children, sections from 0
  parent       integer,                   -- null for a root
  arbor        integer not null,
  branch_order integer not null,          -- 0 for a stem, one more at every branch point
  kind         integer not null,          -- as section_kinds.id
  tag          integer not null,          -- the number the file gave
  soma_point   integer not null,          -- a root: index of the soma point it leaves from, -1 when not known
  points       integer not null,          -- how many; those of all sections follow one another in points.data
  daughters    integer not null,
  length       double precision not null, -- micrometres, as all that follow
  area         double precision not null, -- square micrometres
  start_diameter double precision not null,
  end_diameter double precision not null,
  end_x        double precision not null,
  end_y        double precision not null,
  end_z        double precision not null
);
create view section as
  select n.id as neuron, n.name as name, p.name as population, s.id & 16777215 as section, s.parent, s.arbor,
         s.branch_order, k.name as kind, s.tag, s.points, s.length, s.area, s.start_diameter, s.end_diameter
  from neurons n cross join sections s join populations p on p.id = n.population
       left join section_kinds k on k.id = s.kind
  where s.id >= cast(n.id as bigint) * 16777216 and s.id < (cast(n.id as bigint) + 1) * 16777216;
create view junction as
  select n.id as neuron, n.name as name, p.name as population, s.id & 16777215 as section,
         case s.daughters when 0 then 'terminal' when 1 then 'node' when 2 then 'bifurcation' else 'multifurcation' end
           as junction,
         s.daughters, s.branch_order, s.end_x as x, s.end_y as y, s.end_z as z, s.end_diameter as diameter
  from neurons n cross join sections s join populations p on p.id = n.population
  where s.id >= cast(n.id as bigint) * 16777216 and s.id < (cast(n.id as bigint) + 1) * 16777216;
)sql"},
    // What is known, for people: models, which are grammars by name and version with their distributions. The program
    // writes the texts of grammars anew, with their lines. A population of 0 is none.
    Migration{4, R"sql(
create unique index distributions_by_name on distributions (coalesce(population, 0), name, version);
create table models (
  id         @id,
  name       text    not null,
  version    integer not null,        -- counted from 1; an earlier one is never changed
  grammar    integer not null references grammars (id),
  population integer references populations (id),  -- that it describes; null: none in particular
  origin     text    not null,        -- how this version came to be, in words
  program    text    not null,
  unique (name, version)
);
create table model_distributions (
  model        integer not null references models (id),
  distribution integer not null references distributions (id),
  primary key (model, distribution)
) @by_key;
insert into models (name, version, grammar, origin, program)
  select g.name, row_number() over (partition by g.name order by g.id), g.id, 'neurons were grown from it', ''
  from grammars g order by g.id;
create view model as
  select m.id, m.name, m.version, p.name as population, m.origin, m.program, g.hash, g.text,
         (select count(*) from provenance o where o.grammar = g.id) as neurons
  from models m join grammars g on g.id = m.grammar left join populations p on p.id = m.population;
create view distribution as
  select d.id, d.name, p.name as population, d.version, d.text
  from distributions d left join populations p on p.id = d.population;
)sql"},
    // Values are kept in the order of neurons and not in that of values: a new neuron is written at the ends of the metrics
    // and not all over them, and a range of values is found among one metric's neighbouring rows. The rows of a neuron are
    // removed by the program, so that no key need be looked up.
    Migration{5, R"sql(
drop view metric;
alter table neuron_metrics rename to old_metrics;
drop index metrics_of_neuron;
create table neuron_metrics (
  metric integer not null,            -- as metrics.id
  neuron integer not null,            -- as neurons.id
  value  double precision not null,   -- no row where the metric is not defined
  primary key (metric, neuron)
) @by_key;
insert into neuron_metrics (metric, neuron, value)
  select metric, neuron, value from old_metrics order by metric, neuron;
drop table old_metrics;
@on_a_server create index metrics_by_value on neuron_metrics (metric, value);
create view metric as
  select n.id as neuron, n.name as name, p.name as population, m.name as metric, v.value, m.unit
  from neurons n join populations p on p.id = n.population cross join metrics m
       join neuron_metrics v on v.metric = m.id and v.neuron = n.id;
)sql"},
    // Points that are no decimals are packed too (morphology/packing.h), which an older program does not read. What is there stays.
    Migration{6, ""},
    // Measures of sections are whole numbers of picometres and square nanometres, which SQLite keeps in three or four bytes
    // instead of eight, and the views give them in micrometres. Points are packed from the end of the section they grow out
    // of; those that are there stay, and so do the fingerprints of grown neurons, which now are in the order of their runs.
    Migration{7, R"sql(
drop view section;
drop view junction;
alter table sections rename column length to length_pm;
alter table sections rename column area to area_nm2;
alter table sections rename column start_diameter to start_diameter_pm;
alter table sections rename column end_diameter to end_diameter_pm;
alter table sections rename column end_x to end_x_pm;
alter table sections rename column end_y to end_y_pm;
alter table sections rename column end_z to end_z_pm;
update sections set length_pm = round(1e6 * length_pm), area_nm2 = round(1e6 * area_nm2),
  start_diameter_pm = round(1e6 * start_diameter_pm), end_diameter_pm = round(1e6 * end_diameter_pm),
  end_x_pm = round(1e6 * end_x_pm), end_y_pm = round(1e6 * end_y_pm), end_z_pm = round(1e6 * end_z_pm);
create view section as
  select n.id as neuron, n.name as name, p.name as population, s.id & 16777215 as section, s.parent, s.arbor,
         s.branch_order, k.name as kind, s.tag, s.points, s.length_pm / 1e6 as length, s.area_nm2 / 1e6 as area,
         s.start_diameter_pm / 1e6 as start_diameter, s.end_diameter_pm / 1e6 as end_diameter
  from neurons n cross join sections s join populations p on p.id = n.population
       left join section_kinds k on k.id = s.kind
  where s.id >= cast(n.id as bigint) * 16777216 and s.id < (cast(n.id as bigint) + 1) * 16777216;
create view junction as
  select n.id as neuron, n.name as name, p.name as population, s.id & 16777215 as section,
         case s.daughters when 0 then 'terminal' when 1 then 'node' when 2 then 'bifurcation' else 'multifurcation' end
           as junction,
         s.daughters, s.branch_order, s.end_x_pm / 1e6 as x, s.end_y_pm / 1e6 as y, s.end_z_pm / 1e6 as z,
         s.end_diameter_pm / 1e6 as diameter
  from neurons n cross join sections s join populations p on p.id = n.population
  where s.id >= cast(n.id as bigint) * 16777216 and s.id < (cast(n.id as bigint) + 1) * 16777216;
)sql"},
    // More metrics (stored_metrics.h), and section_radial_distances is measured from the start of its arbor, as NeuroM does. The
    // program works them all out anew.
    Migration{8, "delete from neuron_metrics;\ndelete from metrics;\n"}};

inline constexpr int section_bits = 24;                      // of sections.id
inline constexpr int schema_version = migrations.back().to;  // an older program refuses a newer repository

}  // namespace forest::repository
