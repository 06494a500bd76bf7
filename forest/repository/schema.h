// SPDX-License-Identifier: Apache-2.0
// The tables of a repository; docs/repository/schema.md draws them. Plain SQL that PostgreSQL understands
// too, but for two words: its name for `blob` is `bytea`, and `without rowid` (keep the rows in the order of
// their key) is SQLite's alone.
#pragma once

namespace forest::repository {

inline constexpr int application_id =
    0x42466f72;  // "BFor": how `file` and we tell a repository from other SQLite files
inline constexpr int schema_version = 1;  // raised when an older program could no longer read what is stored

inline constexpr const char* schema = R"sql(
create table populations (
  id   integer primary key,
  name text not null unique
);
create table grammars (
  id   integer primary key,
  name text not null,
  hash text not null,
  text text not null,
  unique (hash, name)
);
create table neurons (
  id          integer primary key,
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
  points blob,                            -- x, y, z, radius: float32, little-endian; null when there are none
  links  blob                             -- cylinders: parent of each point; contours: first point of each; int32
);
create table section_kinds (
  id   integer primary key,               -- numbers of SWC
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
) without rowid;
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
) without rowid;
create table points (
  neuron integer primary key references neurons (id) on delete cascade,
  data   blob not null                    -- x, y, z, radius of every point of every section: float32, little-endian
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
) without rowid;
create table annotations (
  neuron integer not null references neurons (id) on delete cascade,
  number integer not null,                -- order in the file
  name   text not null,                   -- bytes that are no text are written \xHH, a backslash \\
  value  text not null,
  primary key (neuron, number)
) without rowid;
)sql";

}  // namespace forest::repository
