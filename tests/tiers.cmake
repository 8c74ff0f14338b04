# Dear suites, by the name of their ctest entry, each with the cases of it that run with every change (a,b; -: none; of a browser's a part of their titles). The whole suite has the label `night`:
# scripts/test --night=tests runs it. docs/contributing.md says why they are dear.
set(palpate_dear
  # Ranks of MPI wait for each other in a loop, and are killed.
  programs_ranks_test.Bytes                      test_ranks_draw_blocks_of_columns
  programs_ranks_test.Distributed                test_held_axes_have_no_columns
  programs_ranks_test.Dying                      test_a_signal_to_one_rank_stops_all
  programs_ranks_test.Misfits                    test_what_all_ranks_find_is_told_once
  programs_ranks_test.Plans                      test_blocks_of_columns_depend_on_the_model_alone
  programs_parts_test.Parts                      test_parts_divide_the_work
  programs_parts_test.Misfits                    test_parts_of_two_sizes,test_a_damaged_part,test_usage
  programs_parts_test.Guest                      test_signals_before_the_columns_end_it_at_once
  # A browser draws without a graphics card.
  viewer_browser_looks                           "axes have names"
  viewer_browser_hands                           "how a model is looked at is kept"
  viewer_browser_beside                          "a recording stands beside a body"
  viewer_browser_pages                           "one steers"
  viewer_browser_gallery                         "what cannot be opened"
  viewer_browser_run                             "a recording begins|the page comes whole"
  viewer_browser_press                           "a click is felt"
  # Thousands of damaged files, each of which is opened in a child.
  formats_test.Seeds/FlippedBits                 AreRefusedOrInSlackSpace/1
  formats_test.Recording                         IsReadInAnyOrder,ThatIsNotFinishedHoldsEachCheckpoint,IsRefusedWhereABitOfAChunkIsFlipped,SurvivesBeingKilledAtAnyMoment
  formats_test.DynamicsFile                      AKilledRunIsContinuedInBothMatrices,OnlyPackedDynamicsHasAnInverse
  programs_inputs_test.Fuzzed                    -
  programs_files_test.Fuzzed                     -
  programs_recording_test.Reader                 test_lengths_that_lie,test_messages_that_lie,test_no_recordings
  programs_recording_test.SecondRoute            test_by_the_index
  # Other programs: compilers, package managers, notebooks.
  programs_build_flags_test.BuildFlags           test_presets_are_for_this_processor_and_those_of_tests_refuse_warnings
  programs_bindings_test.Clients                 test_feel_the_same_to_the_last_bit
  programs_library_test.Library                  test_found_by_cmake,test_header_is_c99_and_cpp
  book_run_notebooks_test.Kernel                 -
  # Devices that stall, by the clock.
  devices_faults_test.All/Faults                 StayWithinTheClamps/read_error,StayWithinTheClamps/garbage
  devices_play_test                              ABoardIsFeltAsTheSessionSays,KilledInContactItLeavesNoForce
  programs_device_test.Felt                      test_the_hand_rests_where_its_spring_and_the_body_balance,test_a_killed_session_opens_and_its_replay_is_the_same_bit_by_bit
  # Bodies that are baked or pressed for long.
  programs_bake_test.Models                      test_the_nodule_is_made_of_two_materials
  programs_bake_test.Stopped                     test_interrupt_keeps_what_is_done_and_the_old_file_whole,test_a_second_run_is_refused_at_the_start_and_an_early_end_leaves_nothing,test_compression_falls_back_and_a_killed_run_of_it_is_resumed
  programs_live_test.Live                        test_equal_runs_are_equal_and_replay_to_the_bit
  programs_hertz_test.Hertz                      test_a_shallow_press_is_not_held_out_by_edges
  programs_limits_test.Starved                   test_runtime_in_little_address_space,test_stacks_of_openmp
  programs_gallery_test.Drops                    test_a_drop_replaces_no_body
  programs_surfaces_test.Bodies                  test_open_box_has_the_force_of_a_closed_one,test_missing_and_damaged_files
  programs_runtime_test.Tools                    test_a_sphere_is_pushed_out_where_it_touches,test_friction
  programs_outputs_test.Existing                 test_precompute,test_links_keep_their_place
  programs_cattaneo_test.Cattaneo                test_it_slips_in_a_ring
  geometry_test.ImageMesh                        BallHasItsVolumeAndPlace,CavitiesStayEmpty,EdgesOfBoxesAreKept,BadImages,UnreadableFiles
  programs_depth_test.Depth                      test_runs_are_equal_and_replay,test_a_rod_that_gives_way_does_not_lose_the_tool,test_a_closed_loop_makes_no_energy
  programs_long_test.Outputs                     -
  programs_session_test.Session                  test_says_what_is_in_it
  programs_cube_test.CubeFigures                 test_m6
  programs_cube_test.Overlay                     test_figures
  programs_dynamics_test.Swing                   test_both_ways_swing_at_the_first_frequency
  programs_physics_test.Locking                  -
  programs_inputs_test.Surfaces                  test_remeshing_that_spoils_the_surface_falls_back_to_cgal
  programs_files_test.Truncated                  test_while_it_is_in_use_does_nothing
  compressed_test.Compressed                     ForcesOfTouchesAreWithinTheTolerance
  compressed_test.AlteredFile                    AKilledRunGoesOn
  precompute_test.Assembly                       RigidMotionsTakeNoForce,ClampingThreeNodesMakesItPositiveDefinite,PartlyHeldNodesAreLeftOutDofByDof
  live_test.Walls                                ABlockBeginsToSlideAtTheFrictionAngle
  live_test.LiveTruth                            SmallStrainEndsWhereThePageSays
  runtime_contact_test.Radii/RollingContact      ToldStiffnessIsTheDerivativeAtRest/Radius6
  runtime_contact_test.Contacts/LocalModelOfTool ModelIsTheDerivativeOfTheForce/Sticking
  runtime_contact_test.Cases/WholeMeshContact    GivesTheSameForcesAndDisplacements/two_spheres,GivesTheSameForcesAndDisplacements/disc_in_the_plane
  runtime_contact_test.Tools/RandomWalk          NothingBreaksAndTheStateRecovers/ThreeTools
  runtime_contact_test.Spheres/ComesToRest       WhereverItIsHeld/Radius10Friction5,WhereverItIsHeld/Radius2Friction1InThePlane
  dynamics_motion_test.Elements/NewmarkSteps     PackedIsTheSparseSolveOverAThousandSteps/quad4,ModalWithAllModesIsThePackedOne/quad4
)
# palpate_tier(ENTRY CASES TIER): of a dear suite the cases for every change, empty where there are none, and `;night`, to go behind its labels; otherwise
# both are empty
function(palpate_tier entry cases tier)
  set(${cases} "" PARENT_SCOPE)
  set(${tier} "" PARENT_SCOPE)
  list(FIND palpate_dear "${entry}" at)
  if(at EQUAL -1)
    return()
  endif()
  set(${tier} ";night" PARENT_SCOPE)
  math(EXPR at "${at} + 1")
  list(GET palpate_dear ${at} found)
  if(NOT found STREQUAL "-")
    string(REPLACE "," ";" found "${found}")
    set(${cases} "${found}" PARENT_SCOPE)
  endif()
endfunction()
